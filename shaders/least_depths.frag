#include "lib/shadow.glsl"

out float least_depth;             // of a block of SHADOW_BLOCK texels a side: what look-ups may compare with there, at least

// A pixel a block, four texels at a time.
void main() {
    vec2 first = floor(gl_FragCoord.xy) * float(SHADOW_BLOCK);
    vec4 least = vec4(1.0e38);
    for (int y = 0; y < SHADOW_BLOCK; y += 2) {
        for (int x = 0; x < SHADOW_BLOCK; x += 2) {
            least = min(least, least_around(around(first + vec2(x, y) + 1.0)));
        }
    }
    least_depth = min(min(least.x, least.y), min(least.z, least.w));
}
