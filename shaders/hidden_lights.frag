#include "lib/light.glsl"
#include "lib/shadow.glsl"
#include "generated/lights.glsl"

uniform sampler2D low;             // of each tile: tile_bounds.frag
uniform sampler2D high;
uniform sampler2D low_normal;
uniform sampler2D high_normal;
uniform sampler2D least_depths;    // of blocks of the shadow atlas: least_depths.frag
uniform int first_light;
uniform int end_light;

out uint hidden;                   // of a tile, a bit for each light from the first on: does none of its light arrive there?

const int MOST_BLOCKS = 24;        // a side; what covers more of a map is seldom hidden in all of it
const float NEARER = 1e-4;         // what float32 may move a receiver, of its depth, and texels
const int ROUNDING = 1;

bool is_ahead(Light light, vec3 position) {
#ifdef SHADOW_MAPS
    if (light.shadow_count == 1u) return dot(shadowmap_at(light.first_shadow_map).w, vec4(position, 1.0)) > 0.0;
#endif
    return true;
}

// Does all that lies in the box of `corners` have something before it, as the light sees it in one map?
bool is_hidden(Light light, vec3 corners[8]) {
    if (light.shadow_count == 0u) return false;
    ShadowTexel at = shadow_texel(light, corners[0]);
    vec2 least = at.least, low = at.place, high = at.place;
    float nearest = at.depth, side = at.side;
    bool in_one = is_ahead(light, corners[0]);
    for (int i = 1; i < 8; ++i) {
        at = shadow_texel(light, corners[i]);
        in_one = in_one && at.least == least && is_ahead(light, corners[i]);
        low = min(low, at.place);
        high = max(high, at.place);
        nearest = max(nearest, at.depth);
    }
    low = clamp(low, least + 1.5, least + side - 1.5);
    high = clamp(high, least + 1.5, least + side - 1.5);
    ivec2 first = (ivec2(floor(low + 0.5)) - 1 - ROUNDING) / SHADOW_BLOCK;
    ivec2 last = (ivec2(floor(high + 0.5)) + ROUNDING) / SHADOW_BLOCK;
    if (!in_one || any(greaterThanEqual(last - first, ivec2(MOST_BLOCKS)))) return false;
    float bound = nearest + NEARER * abs(nearest) + 1e-6 * NEARER;
    bool behind = true;
    for (int y = first.y; y <= last.y && behind; ++y) {
        for (int x = first.x; x <= last.x && behind; ++x) behind = texelFetch(least_depths, ivec2(x, y), 0).x > bound;
    }
    return behind;
}

// Is the light behind all surfaces of a tile? Each pair of a normal and a direction to the light lies between their bounds.
bool is_behind(Light light, vec3 least, vec3 most, vec3 least_normal, vec3 most_normal) {
    vec3 place = light.is_whole != 0u ? light.centre : light.position;
    vec3 nearest = is_distant(light) ? -light.axis : place - most, farthest = is_distant(light) ? -light.axis : place - least;
    vec3 products = max(max(least_normal * nearest, least_normal * farthest), max(most_normal * nearest, most_normal * farthest));
    float away = length(max(abs(nearest), abs(farthest)));
    return products.x + products.y + products.z < -1e-5 * away;
}

// A pixel a tile.
void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy);
    vec3 least = texelFetch(low, tile, 0).xyz, most = texelFetch(high, tile, 0).xyz;
    vec3 least_normal = texelFetch(low_normal, tile, 0).xyz, most_normal = texelFetch(high_normal, tile, 0).xyz;
    vec3 slack = vec3(1e-6 * max(length(least), length(most)));
    vec3 corners[8];
    for (int i = 0; i < 8; ++i) {
        corners[i] = mix(least - slack, most + slack, bvec3((i & 1) != 0, (i & 2) != 0, (i & 4) != 0));
    }
    hidden = 0u;
    if (least.x > most.x) return;
    for (int i = first_light; i < end_light; ++i) {
        Light light = light_of(uint(i));
        bool none = is_behind(light, least, most, least_normal, most_normal) || is_hidden(light, corners);
        if (none) hidden |= 1u << uint(i - first_light);
    }
}
