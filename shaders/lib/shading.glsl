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
float turn_at(Surface s, ivec2 pixel) {
#ifdef PLANE_WEIGHTS
    return s.turn;             // the neighbours may show what lies behind
#else
    ivec2 inward = ivec2(lessThan(vec2(pixel) * 2.0, view.size)) * 2 - 1;
    vec3 across = read_planes(pixel + ivec2(inward.x, 0)).normal - s.normal;
    vec3 along = read_planes(pixel + ivec2(0, inward.y)).normal - s.normal;
    return turn_of(across, along);
#endif
}

// How much alpha² grows where a sample stands for its share of a pixel in which the normal turns: twice the variance of a
// square of the pixel that is as large, twice as alpha² counts it, and at most 0.18 (Tokuyoshi & Kaplanyan 2019, "Improved
// Geometric Specular Antialiasing"). Shares shrink with the number of samples, so the mean still converges; without, single
// samples would hit highlights that are smaller than a pixel.
float pixel_alpha_squared(Surface s, ivec2 pixel) {
    if (view.pixel_share == 0.0 || sharpest_roughness(s) > 0.35) return 0.0;
    return view.pixel_share * min(turn_at(s, pixel) / 6.0, 0.18);
}
#else
float pixel_alpha_squared(Surface s, ivec2 pixel) {
    return 0.0;
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

// What `irradiance` along `l` adds to a surface seen from `v`, before exposure; blur: of the pixel.
Lit lit_by(Light light, vec3 l, vec3 irradiance, Surface surface, vec3 position, vec3 v, float blur) {
    Lit lit;
    lit.sent = dot(irradiance, vec3(1.0)) * max(dot(surface.normal, l), 0.0);
    lit.volumes = 1.0;
    float visible = visibility(light, position);
    lit.arrived = lit.sent * visible;
#ifdef SHADOW_STYLES
    irradiance *= mix(light.shadow_color, vec3(1.0), visible);
#else
    irradiance *= visible;
#endif
    vec3 response = lobe_response(light, surface);
#ifdef PATCHES
    float solid_angle = patch_solid_angle(light, position, l);
    surface.blur = blur + patch_alpha_squared(solid_angle);
#endif
#ifdef LOBE_RAYS
    if (light.by_rays != 0u) {
        surface.blur = 0.0;    // a pixel's own rays are strewn as wide as its lobes
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
