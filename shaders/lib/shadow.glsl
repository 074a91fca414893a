#include "lib/records.glsl"

#ifdef SHADOWS
#include "generated/shadow_maps.glsl"

uniform sampler2D shadow_atlas;

// Receivers count as nearer to the light by a share of a texel, which clears float32 rounding; the records hold it. The maps'
// own depth offset keeps surfaces from shadowing themselves.
struct ShadowTexel {
    vec2 place;                // in the atlas, in texels
    vec2 least;                // where its map begins
    float side;                // of its map, in texels
    float depth;               // of the receiver, as maps store it
    vec2 depth_coefficients;   // see ShadowMap
};

#ifdef SHADOW_CUBES
uniform vec4 cube_window;      // in a face at u and v one unit ahead: texel = cube_window.xy * (u, v) + cube_window.zw
uniform vec2 cube_depth;       // stored = cube_depth.x / depth + cube_depth.y
uniform vec2 cube_coefficients;
uniform ivec2 atlas_grid;      // of maps in a row of the atlas, and of texels along a map's side, the binary logarithms

// In a light's six faces, +X -X +Y -Y +Z -Z: a face along an axis has the next two for its sides.
ShadowTexel in_cube(Light light, vec3 position) {
    vec3 away = position - light.position;
    vec3 size = abs(away);
    bool x = size.x >= size.y && size.x >= size.z, y = !x && size.y >= size.z;
    vec3 sides = x ? away.yzx : y ? away.zxy : away;
    float depth = abs(sides.z);
    int slot = int(light.first_shadow) + (x ? 0 : y ? 2 : 4) + int(sides.z < 0.0);
    ShadowTexel at;
    at.side = float(1 << atlas_grid.y);
    at.least = vec2(ivec2(slot & (1 << atlas_grid.x) - 1, slot >> atlas_grid.x) << atlas_grid.y);
    vec2 across = vec2(sides.z < 0.0 ? sides.x : -sides.x, sides.y) / depth;
    at.place = at.least + cube_window.xy * across + cube_window.zw;
    at.depth = cube_depth.x / depth + cube_depth.y;
    at.depth_coefficients = cube_coefficients;
    return at;
}
#endif

#ifdef SHADOW_MAPS
ShadowTexel in_map(Light light, vec3 position) {
    ShadowMap map = shadowmap_at(light.first_shadow_map);
    vec4 relative = vec4(position, 1.0);
    float w = dot(map.w, relative);
    ShadowTexel at;
    at.side = map.side;
    at.least = map.least;
    at.place = vec2(dot(map.x, relative), dot(map.y, relative)) / w;
    at.depth = dot(map.z, relative) / w;
    at.depth_coefficients = map.depth_coefficients;
    return at;
}
#endif

ShadowTexel shadow_texel(Light light, vec3 position) {
#if defined(SHADOW_MAPS) && defined(SHADOW_CUBES)
    if (light.shadow_count == 6u) return in_cube(light, position);
    return in_map(light, position);
#elif defined(SHADOW_CUBES)
    return in_cube(light, position);
#else
    return in_map(light, position);
#endif
}

#ifdef SHADOW_STYLES
// UsdLuxShadowAPI: how much of each texel's shadow is left at the receiver. What the map knows is the occluder nearest to
// the light.
vec4 shadow_strength(Light light, ShadowTexel at, vec4 stored, vec3 position) {
    if (light.shadow_distance < 0.0) return vec4(1.0);
    vec4 occluders = at.depth_coefficients.x * stored + at.depth_coefficients.y;
    float own = at.depth_coefficients.x * at.depth + at.depth_coefficients.y;
    vec4 apart = own - occluders;
    if (!is_distant(light)) apart = length(light.position - position) * (1.0 - own / occluders);
    vec4 left = light.shadow_distance - apart;
    if (light.shadow_fading <= 0.0) return vec4(greaterThanEqual(left, vec4(0.0)));
    return pow(clamp(left / light.shadow_fading, 0.0, 1.0), vec4(light.shadow_gamma));
}
#endif

// Share of the light that reaches a relative position: the four nearest texels, bilinearly.
float visibility(Light light, vec3 position) {
    if (light.shadow_count == 0u) return 1.0;
    ShadowTexel at = shadow_texel(light, position);
    vec2 place = clamp(at.place, at.least + 0.5, at.least + at.side - 0.5);
    vec4 stored = textureGather(shadow_atlas, place / ATLAS, 0);
    vec4 lit = vec4(lessThanEqual(stored, vec4(at.depth)));
#ifdef SHADOW_STYLES
    lit = 1.0 - (1.0 - lit) * shadow_strength(light, at, stored, position);
#endif
    vec2 t = fract(place - 0.5);
    vec2 row = mix(lit.wx, lit.zy, t.x);
    return mix(row.x, row.y, t.y);
}
#else
float visibility(Light light, vec3 position) {
    return 1.0;
}
#endif
