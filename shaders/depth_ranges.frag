#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "generated/planes.glsl"

out vec2 depth_range;              // nearest and farthest camera depth of a tile; reversed where nothing is

const int TILE = LIGHT_TILE;

// A pixel a tile: the depths in it.
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * TILE;
    ivec2 last = min(first + TILE, ivec2(view.size));
    float least = 1.0e38;
    float most = -1.0e38;
    for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) {
            float stored = texelFetch(plane_depth, ivec2(x, y), 0).x;
            float depth = camera_depth(stored);
            least = stored == BACKGROUND_DEPTH ? least : min(least, depth);
            most = stored == BACKGROUND_DEPTH ? most : max(most, depth);
        }
    }
    depth_range = vec2(least, most);
}
