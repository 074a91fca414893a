#include "lib/light_sum.glsl"
#include "generated/outputs.glsl"
#include "generated/lights.glsl"

layout(std430, binding = 4) readonly buffer LightListBlock { uint light_lists[]; };

uniform usampler2D tile_runs;      // of each tile, the first entry in the lists and how many

// Every light of a pixel's tile: what the GBuffer says of it is read once.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec2 run = texelFetch(tile_runs, pixel / LIGHT_TILE, 0).xy;
    if (run.y == 0u) discard;
    float stored = texelFetch(plane_depth, pixel, 0).x;
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored)), v = direction_to_eye(position);
    Surface surface = read_planes(pixel);
    see_footprint(surface, pixel);
    if (stored == BACKGROUND_DEPTH) discard;
    Lit total = no_light(run.y);
    for (uint i = run.x; i < run.x + run.y; ++i) {
        add_light(total, light_of(light_lists[i]), surface, position, v);
    }
    write_light(exposed(total));
}
