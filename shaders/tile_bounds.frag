#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "generated/planes.glsl"

// Of what a tile shows: the corners of boxes around its relative positions, and around its normals; reversed where nothing is.
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
layout(location = 2) out vec4 low_normal;
layout(location = 3) out vec4 high_normal;

// A pixel a tile.
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * LIGHT_TILE, last = min(first + LIGHT_TILE, ivec2(view.size));
    vec3 least = vec3(1.0e38), most = -least, least_normal = least, most_normal = most;
    for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) {
            ivec2 pixel = ivec2(x, y);
            float stored = texelFetch(plane_depth, pixel, 0).x;
            vec3 position = position_at(vec2(pixel) + 0.5, camera_depth(stored)), normal = read_planes(pixel).normal;
            bvec3 empty = bvec3(stored == BACKGROUND_DEPTH);
            least = mix(min(least, position), least, empty);
            most = mix(max(most, position), most, empty);
            least_normal = mix(min(least_normal, normal), least_normal, empty);
            most_normal = mix(max(most_normal, normal), most_normal, empty);
        }
    }
    low = vec4(least, 0.0);
    high = vec4(most, 0.0);
    low_normal = vec4(least_normal, 0.0);
    high_normal = vec4(most_normal, 0.0);
}
