#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/light.glsl"
#include "lib/shadow.glsl"
#ifdef PLANE_LINKS
#include "lib/linking.glsl"
#endif
#ifdef LOBE_RAYS
#include "lib/lobe_rays.glsl"
#endif
#include "lib/render_space.glsl"
#include "lib/lit.glsl"
#include "generated/planes.glsl"

#ifdef PATCHES
const float SHARP = 0.35;          // roughness: wider lobes hardly vary over a pixel
const float MOST_TURN = 1.08;      // of a normal over a pixel, squared

// The mean of two changes, or the less where one of them may lead beyond an edge.
vec3 likely(vec3 one, vec3 other) {
    float a = dot(one, one), b = dot(other, other);
    return max(a, b) < 4.0 * min(a, b) ? 0.5 * (one + other) : a < b ? one : other;
}

// How the normal changes from this pixel to the next, by that of its neighbours that is the less likely to lie beyond an edge.
// `within` is the change within its two by two pixels; the other neighbour is fetched.
vec3 turn_along(vec3 normal, ivec2 pixel, ivec2 next, vec3 within) {
    ivec2 last = ivec2(view.size) - 1;
    bool is_second = (pixel & next) != ivec2(0);
    ivec2 apart = is_second ? pixel + next : pixel - next, inside = clamp(apart, ivec2(0), last);
    vec3 beyond = read_planes(inside).normal - normal;
    if (!is_second) beyond = -beyond;
    if (inside != apart) return within;
    return !is_second && any(greaterThan(pixel + next, last)) ? beyond : likely(within, beyond);
}

// The normals of a sample's cell of its pixel, each of which stands for a disc as wide as its part of it; parts as large as the
// narrowest lobe do. Cells tile pixels and shrink with the number of samples; a point in each would miss smaller highlights.
// Not within a branch: pixels beside each other tell of their normals.
void see_footprint(inout Surface s, ivec2 pixel) {
    float roughness = sharpest_roughness(s);
#ifdef PLANE_WEIGHTS
    if (roughness <= SHARP) s.blur = view.cell.z * view.cell.w * min(s.turn, MOST_TURN) / 6.0;    // neighbours may lie behind
#else
    vec3 x = dFdxFine(s.normal), y = dFdyFine(s.normal);
    if (roughness <= SHARP) {
        x = turn_along(s.normal, pixel, ivec2(1, 0), x);
        y = turn_along(s.normal, pixel, ivec2(0, 1), y);
        float most = sqrt(min(1.0, MOST_TURN / max(turn_of(x, y), 1e-12)));
        x *= most;
        y *= most;
        float width = sqrt(turn_of(view.cell.z * x, view.cell.w * y));
        float alpha = GGX_alpha(roughness);
        int side = 1;
#ifdef CELL_PARTS
        if (width > alpha) side = int(min(ceil(width / alpha), float(CELL_PARTS)));    // not for a background's NaN
#endif
        s.footprint.side = side;
        s.footprint.across = x * (view.cell.z / float(side));
        s.footprint.along = y * (view.cell.w / float(side));
        vec3 middle = view.cell.x * x + view.cell.y * y;
        s.footprint.first = middle - 0.5 * float(side - 1) * (s.footprint.across + s.footprint.along);
        s.blur = turn_of(s.footprint.across, s.footprint.along) / 6.0;
    }
#endif
}
#else
void see_footprint(inout Surface s, ivec2 pixel) {
}
#endif

// What of each lobe a light may show: the environment pass shows a dome in the sharp ones.
vec3 lobe_response(Light light, Surface s) {
    vec3 response = vec3(1.0);
#ifdef RESPONSES
    response *= light.response.xyy;
#endif
#ifdef PLANE_WEIGHTS
    response *= s.weights.xyy;
#endif
#ifdef SKY
    if (light.is_sky == 0u || light.by_rays != 0u) return response;
#ifdef PLANE_CLEARCOAT
    response.z *= 1.0 - sharpness(s.clearcoat_roughness, view.sky_share);
#endif
    response.y *= 1.0 - sharpness(s.roughness, view.sky_share);
#endif
    return response;
}

bool is_lit_by(Light light, Surface surface) {
#ifdef PLANE_LINKS
    return is_linked(light.first_link, surface.link_set);
#else
    return true;
#endif
}

// What `irradiance` along `l` adds to a surface seen from `v`, before exposure.
Lit lit_by(Light light, vec3 l, vec3 irradiance, Surface surface, vec3 position, vec3 v) {
    Lit lit;
    lit.sent = dot(irradiance, vec3(1.0)) * max(dot(surface.normal, l), 0.0);
    lit.volumes = 1.0;
    float visible = visibility(light, position, triangle_of(surface));
    lit.arrived = lit.sent * visible;
#ifdef SHADOW_STYLES
    irradiance *= mix(light.shadow_color, vec3(1.0), visible);
#else
    irradiance *= visible;
#endif
    vec3 response = lobe_response(light, surface);
#ifdef PATCHES
    float solid_angle = patch_solid_angle(light, position, l);
    surface.blur += patch_alpha_squared(solid_angle);
#endif
#ifdef LOBE_RAYS
    if (light.by_rays != 0u) {
        surface.blur = 0.0;    // a pixel's own rays are strewn as wide as its lobes
        surface.footprint = POINT;
        response.yz *= share_beside_rays(surface, v, l, solid_angle);
    }
#endif
    vec3 arriving = render_from_rec709(irradiance);
    lit.radiance = arriving * evaluate_brdf(surface, v, l, response);
#ifdef SPLIT
    lit.diffuse = arriving * evaluate_brdf(surface, v, l, vec3(response.x, 0.0, 0.0));
#endif
    return lit;
}

Lit exposed(Lit lit) {
    lit.radiance *= view.exposure;
    lit.diffuse *= view.exposure;
    return lit;
}
