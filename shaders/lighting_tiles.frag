#include "lib/shading.glsl"
#include "generated/outputs.glsl"
#include "generated/light_block.glsl"

layout(std430, binding = 9) readonly buffer LightListBlock { uint light_lists[]; };

flat in uvec2 tile_run;

// Every light of a tile: what the GBuffer says of a pixel is read once.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    if (stored == BACKGROUND_DEPTH) discard;
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored));
    Surface surface = read_planes(pixel);
    vec3 v = direction_to_eye(position);
    float widening = pixel_alpha_squared(surface, pixel);
    Lit total = Lit(vec3(0.0), vec3(0.0), 0.0, 0.0, float(tile_run.y));
    for (uint i = tile_run.x; i < tile_run.x + tile_run.y; ++i) {
        Light light = light_at(light_lists[i]);
        vec3 l;
        vec3 irradiance = irradiance_from(light, position, l);
        if (irradiance == vec3(0.0) || !is_lit_by(light, surface)) continue;
        Lit lit = lit_by(light, l, irradiance, surface, position, v, widening);
        total.radiance += lit.radiance;
        total.diffuse += lit.diffuse;
        total.sent += lit.sent;
        total.arrived += lit.arrived;
    }
    write_light(exposed(total));
}
