#include "lib/records.glsl"

#ifdef SHADOWS
layout(std430, binding = 4) readonly buffer ShadowBlock { ShadowMap shadow_maps[]; };
uniform sampler2D shadow_atlas;

// The six maps of a light that sees all around, in the order +X −X +Y −Y +Z −Z.
uint cube_face(vec3 direction) {
    vec3 a = abs(direction);
    if (a.x >= a.y && a.x >= a.z) return direction.x >= 0.0 ? 0u : 1u;
    if (a.y >= a.z) return direction.y >= 0.0 ? 2u : 3u;
    return direction.z >= 0.0 ? 4u : 5u;
}

// Towards the light, in texels: clears float32 rounding. The maps' own depth offset keeps surfaces from shadowing themselves.
const float LIGHT_OFFSET = 0.02;

#ifdef SHADOW_STYLES
// UsdLuxShadowAPI: how much of each texel's shadow is left at a receiver of depth `receiver` in the map. What the map
// knows is the occluder nearest to the light.
vec4 shadow_strength(Light light, ShadowMap map, vec4 stored, float receiver, vec3 position) {
    if (light.shadow_distance < 0.0) return vec4(1.0);
    vec4 occluders = map.depth_coefficients.x * stored + map.depth_coefficients.y;
    float own = map.depth_coefficients.x * receiver + map.depth_coefficients.y;
    vec4 apart = own - occluders;
    if (!is_distant(light)) apart = length(light.position - position) * (1.0 - own / occluders);
    vec4 left = light.shadow_distance - apart;
    if (light.shadow_fading <= 0.0) return vec4(greaterThanEqual(left, vec4(0.0)));
    return pow(clamp(left / light.shadow_fading, 0.0, 1.0), vec4(light.shadow_gamma));
}
#endif

// Share of the light that reaches a relative position: the four nearest texels, bilinearly.
float visibility(Light light, vec3 position, vec3 l) {
    if (light.shadow_count == 0u) return 1.0;
    uint face = light.shadow_count == 6u ? cube_face(-l) : 0u;
    ShadowMap map = shadow_maps[light.first_shadow + face];
    float texel = map.texel * (map.clip_from_relative * vec4(position, 1.0)).w; // in scene units at the receiver
    vec4 clip = map.clip_from_relative * vec4(position + texel * LIGHT_OFFSET * l, 1.0);
    vec3 ndc = clip.xyz / clip.w;
    vec2 within = (0.5 + 0.5 * vec2(ndc.x, -ndc.y)) * map.resolution;
    within = clamp(within, 0.5, map.resolution - 0.5);
    vec4 stored = textureGather(shadow_atlas, map.tile.xy + within / map.resolution * map.tile.zw, 0);
    vec4 lit = vec4(lessThanEqual(stored, vec4(ndc.z)));
#ifdef SHADOW_STYLES
    lit = 1.0 - (1.0 - lit) * shadow_strength(light, map, stored, ndc.z, position);
#endif
    vec2 t = fract(within - 0.5);
    vec2 row = mix(lit.wx, lit.zy, t.x);
    return mix(row.x, row.y, t.y);
}
#else
float visibility(Light light, vec3 position, vec3 l) {
    return 1.0;
}
#endif
