#include "lib/shading.glsl"
#include "generated/outputs.glsl"
#include "generated/light_block.glsl"

layout(std430, binding = 4) readonly buffer LightListBlock { uint light_lists[]; };

uniform usampler2D tile_runs;      // of each tile, the first entry in the lists and how many

// Every light of a pixel's tile: what the GBuffer says of it is read once.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    if (stored == BACKGROUND_DEPTH) discard;
    uvec2 run = texelFetch(tile_runs, pixel / LIGHT_TILE, 0).xy;
    if (run.y == 0u) discard;
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored));
    Surface surface = read_planes(pixel);
    vec3 v = direction_to_eye(position);
    float blur = pixel_alpha_squared(surface, pixel);
    Lit total = Lit(vec3(0.0), vec3(0.0), 0.0, 0.0, float(run.y));
    for (uint i = run.x; i < run.x + run.y; ++i) {
        Light light = light_at(light_lists[i]);
        vec3 l;
        vec3 irradiance = irradiance_from(light, position, l);
        if (irradiance == vec3(0.0) || !is_lit_by(light, surface)) continue;
        Lit lit = lit_by(light, l, irradiance, surface, position, v, blur);
        total.radiance += lit.radiance;
        total.diffuse += lit.diffuse;
        total.sent += lit.sent;
        total.arrived += lit.arrived;
    }
    write_light(exposed(total));
}
