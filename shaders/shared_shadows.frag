#include "lib/surface.glsl"
#include "lib/light.glsl"
#include "lib/shadow.glsl"
#include "lib/shared_shadows.glsl"
#include "generated/planes.glsl"
#include "generated/shared_maps.glsl"

out uvec2 seen;                    // four bits for each of some directions: the share of their light that reaches a pixel

// A pixel for each of one class, side by side; none asks one that shows no surface.
void main() {
    ivec2 pixel = min(pixel_of_cell(ivec2(gl_FragCoord.xy)), ivec2(view.size) - 1);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    if (stored == BACKGROUND_DEPTH) discard;
    vec3 position = position_at(vec2(pixel) + 0.5, camera_depth(stored));
    seen = look_up_shared(position, triangle_of(read_planes(pixel)));
}
