#include "lib/view.glsl"
#include "generated/shared_shadows.glsl"

uniform int shared_class;          // of the pixels that have looked up the shadows of this draw's directions

// Rows of a lattice, in which a run of pixels has one of each class, across and down.
int class_of(ivec2 pixel) {
    ivec2 at = pixel + ivec2(view.origin);
    return (at.x + 3 * at.y) & (SHARED_CLASSES - 1);
}

// The pixel of the class in a run of them: `cell` is its place in what they have looked up.
ivec2 pixel_of_cell(ivec2 cell) {
    int first = cell.x * SHARED_CLASSES;
    return ivec2(first + ((shared_class - class_of(ivec2(first, cell.y))) & (SHARED_CLASSES - 1)), cell.y);
}

ivec2 cell_of_pixel(ivec2 pixel) {
    return ivec2(pixel.x / SHARED_CLASSES, pixel.y);
}
