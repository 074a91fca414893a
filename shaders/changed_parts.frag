#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "generated/planes.glsl"

uniform usampler2D tile_changes;       // of each LIGHT_TILE pixels a side, a bit for each map that may change there
uniform sampler2D block_depths;        // row by row: near and far where a block of a map changed, reversed elsewhere
uniform mat4 places_from_relative[MOST_CHANGES];   // to texels and stored depth, times w
uniform ivec4 grids[MOST_CHANGES];     // of blocks: column and row of the first, how many in a row, and texels a side
uniform ivec2 heights[MOST_CHANGES];   // rows of blocks, and where the first is in block_depths

out float changed;                     // of a part of PART pixels a side: may a shadow fall there otherwise?

bool is_changed(int map, vec3 position) {
    vec4 place = places_from_relative[map] * vec4(position, 1.0);
    if (place.w <= 0.0) return false;
    ivec4 grid = grids[map];
    ivec2 block = ivec2(floor((place.xy / place.w + 0.5) / float(grid.w))) - grid.xy;
    if (any(lessThan(block, ivec2(0))) || block.x >= grid.z || block.y >= heights[map].x) return false;
    int number = heights[map].y + block.y * grid.z + block.x, width = textureSize(block_depths, 0).x;
    vec2 depths = texelFetch(block_depths, ivec2(number % width, number / width), 0).xy;
    float stored = place.z / place.w;
    return stored <= depths.x && stored >= depths.y;
}

// A pixel a part.
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * PART, last = min(first + PART, ivec2(view.size));
    uint maps = texelFetch(tile_changes, first / LIGHT_TILE, 0).x;
    bool found = false;
    for (; maps != 0u && !found; maps &= maps - 1u) {
        int map = findLSB(maps);
        for (int y = first.y; y < last.y && !found; ++y) {
            for (int x = first.x; x < last.x; ++x) {
                float stored = texelFetch(plane_depth, ivec2(x, y), 0).x;
                vec3 position = position_at(vec2(x, y) + 0.5, camera_depth(stored));
                found = found || stored != BACKGROUND_DEPTH && is_changed(map, position);
            }
        }
    }
    changed = float(found);
}
