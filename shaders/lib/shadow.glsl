#include "lib/records.glsl"

#ifdef SHADOWS
#include "generated/shadow_maps.glsl"

uniform sampler2D shadow_atlas;

// Receivers count as nearer to the light by a share of a texel, which clears float32 rounding; the records hold it.
struct ShadowTexel {
    vec2 place;                // in the atlas, in texels
    vec2 least;                // where its map begins
    float side;                // of its map, in texels
    float depth;               // of the receiver, as maps store it
    vec2 depth_coefficients;   // see ShadowMap
#ifdef PLANE_TRIANGLE
    mat3 gradients;            // columns: of the place along its sides and of the depth, by the position
#endif
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
#ifdef PLANE_TRIANGLE
    float ahead = sign(sides.z);
    mat3 along = mat3(vec3(-ahead, 0.0, -across.x * ahead) * cube_window.x,
                      vec3(0.0, 1.0, -across.y * ahead) * cube_window.y,
                      vec3(0.0, 0.0, -cube_depth.x / depth * ahead)) / depth;
    for (int i = 0; i < 3; ++i) at.gradients[i] = x ? along[i].zxy : y ? along[i].yzx : along[i];
#endif
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
#ifdef PLANE_TRIANGLE
    at.gradients = mat3(map.x.xyz - at.place.x * map.w.xyz, map.y.xyz - at.place.y * map.w.xyz, map.z.xyz - at.depth * map.w.xyz) / w;
#endif
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

// What surfaces may leave between themselves and their receivers, of their depth's steps from texel to texel: the snapping of
// vertices to a raster's grid, and bends that are as narrow as a texel.
const float STEP_OFFSET = 1.0 / 32.0, BEND_OFFSET = 0.5;
const float STRAIGHT = 32.0;    // times that a surface bends less ahead than at a texel beside another

// Depths at four texels that meet at a corner, as textureGather has them, and the steps to each from the one behind it and from it
// to the one beside it, along rows and columns.
struct Around {
    vec4 z;
    vec4 x0;
    vec4 x1;
    vec4 y0;
    vec4 y1;
};

// `corner` in texels of the atlas.
Around around(vec2 corner) {
    vec2 low = (corner - 1.0) / ATLAS, high = (corner + 1.0) / ATLAS;
    vec4 ll = textureGather(shadow_atlas, low, 0), hl = textureGather(shadow_atlas, vec2(high.x, low.y), 0);
    vec4 lh = textureGather(shadow_atlas, vec2(low.x, high.y), 0), hh = textureGather(shadow_atlas, high, 0);
    vec4 z = vec4(lh.z, hh.w, hl.x, ll.y);
    return Around(z, z - vec4(lh.w, hh.z, hl.y, ll.x), z.yxwz - z, z - vec4(lh.y, hh.x, hl.w, ll.z), z.wzyx - z);
}

// At least, where the surfaces at those texels go on to in any look-up: casters_at below.
vec4 least_around(Around texels) {
    vec4 x_before = abs(texels.x0), x_after = abs(texels.x1), y_before = abs(texels.y0), y_after = abs(texels.y1);
    vec4 fall = max(x_before, x_after) + max(y_before, y_after);
    vec4 bends = min(x_before, x_after) + min(y_before, y_after);
    return texels.z - (1.0 + STEP_OFFSET) * fall - BEND_OFFSET * bends;
}

struct Casters {
    vec4 stored;               // depths at the four texels around a receiver
    vec4 here;                 // where each one's surface goes on to at the receiver
};

// What a row's surfaces go on by from its texels towards the receiver, by the steps that lead there and those from behind, and how
// much they may bend; `across` has the other texel of each pair.
struct Steps {
    vec4 on;
    vec4 bends;
};

// The deeper of both: on a plane both are right, on a ridge the step ahead, in a hollow that from behind, and at an edge neither
// hides what is beyond it. But where the surface ahead is straight and turns at the texel by much more, what lies behind is
// another, nearer to the light, and says nothing of this one.
Steps steps_of(vec4 behind, vec4 ahead, vec4 bend, vec4 bend_ahead) {
    vec4 deeper = min(behind, ahead);
    vec4 bends = min(bend, abs(clamp(vec4(0.0), deeper, max(behind, ahead))));
    bvec4 straight = lessThan(STRAIGHT * bend_ahead, bend);
    return Steps(mix(deeper, ahead, straight), mix(bends, min(bends, bend_ahead / BEND_OFFSET), straight));
}

// A texel's surface goes on to the receiver. Depths that are compared across a texel instead either shadow slopes by
// themselves or, offset, let light through where things touch.
Casters casters_at(vec2 place) {
    vec2 corner = floor(place + 0.5), t = place + 0.5 - corner;
    Around texels = around(corner);
    vec4 z = texels.z, x0 = texels.x0, x1 = texels.x1, y0 = texels.y0, y1 = texels.y1;
    vec4 x_bend = abs(x1 - x0), y_bend = abs(y1 - y0);
    Steps x = steps_of(x0, x1, x_bend, x_bend.yxwz), y = steps_of(y0, y1, y_bend, y_bend.wzyx);
    vec4 dx = vec4(t.x, 1.0 - t.x, 1.0 - t.x, t.x), dy = vec4(1.0 - t.y, 1.0 - t.y, t.y, t.y);
    vec4 aside = max(min(z + z.zwxy - z.yxwz - z.wzyx, -max(x.on, y.on)), 0.0);
    vec4 offset = STEP_OFFSET * (abs(x.on) + abs(y.on)) + BEND_OFFSET * (x.bends + y.bends);
    return Casters(z, z + x.on * dx + y.on * dy + aside * dx * dy - offset);
}

#ifdef PLANE_TRIANGLE
const float LIFT = 0.5;        // texels: how far beside a receiver its surface may lie before its triangle's plane

// Do the texels of a look-up show what lies before the plane of the receiver's triangle, as it goes on to their middles? Where
// coins have texels show one layer or another, steps from texel to texel tell of no surface, and deep ones let light through.
bvec4 is_before(vec4 stored, ShadowTexel at, vec2 place, vec3 triangle) {
    mat3 g = at.gradients;
    vec3 towards = cross(g[0], g[1]);                      // in which places stay; its length is texels over area
    vec2 slope = vec2(dot(triangle, cross(g[2], g[1])), dot(triangle, cross(g[0], g[2]))) / dot(triangle, towards);
    float texel = abs(dot(g[2], towards)) * pow(dot(towards, towards), -0.75);
    vec2 low = floor(place + 0.5) - 0.5 - place;
    vec4 plane = at.depth + slope.x * (low.x + vec4(0.0, 1.0, 1.0, 0.0)) + slope.y * (low.y + vec4(1.0, 1.0, 0.0, 0.0));
    float offset = LIFT * texel + STEP_OFFSET * (abs(slope.x) + abs(slope.y));
    return greaterThan(stored, max(plane, at.depth) + offset);
}
#endif

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
float visibility(Light light, vec3 position, vec3 triangle) {
    if (light.shadow_count == 0u) return 1.0;
    ShadowTexel at = shadow_texel(light, position);
    vec2 place = clamp(at.place, at.least + 1.5, at.least + at.side - 1.5);
    Casters casters = casters_at(place);
    vec4 lit = vec4(lessThanEqual(casters.here, vec4(at.depth)));
#ifdef PLANE_TRIANGLE
    lit *= vec4(not(is_before(casters.stored, at, place, triangle)));
#endif
#ifdef SHADOW_STYLES
    lit = 1.0 - (1.0 - lit) * shadow_strength(light, at, casters.stored, position);
#endif
    vec2 t = fract(place - 0.5);
    vec2 row = mix(lit.wx, lit.zy, t.x);
    return mix(row.x, row.y, t.y);
}
#elif defined(SHARED_SHADOWS)
#include "lib/shared_seen.glsl"

float visibility(Light light, vec3 position, vec3 triangle) {
    return shared_visibility(light.first_shadow_map);
}
#else
float visibility(Light light, vec3 position, vec3 triangle) {
    return 1.0;
}
#endif
