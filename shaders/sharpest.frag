#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "generated/planes.glsl"

out float sharpest;                // the least roughness of any lobe in a tile; 1 where nothing is

const int TILE = LIGHT_TILE;

// A pixel a tile: what is in it.
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * TILE;
    ivec2 last = min(first + TILE, ivec2(view.size));
    sharpest = 1.0;
    for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) {
            float stored = texelFetch(plane_depth, ivec2(x, y), 0).x;
            float roughness = sharpest_roughness(read_planes(ivec2(x, y)));
            sharpest = stored == BACKGROUND_DEPTH ? sharpest : min(sharpest, roughness);
        }
    }
}
