#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/light.glsl"
#include "lib/shadow.glsl"
#include "lib/luminance.glsl"
#include "generated/planes.glsl"
#include "generated/lights.glsl"

uniform uint light_count;

out vec4 sent;                     // light of directions of the sky in a sharp lobe: what reaches it, all, and their number

float widened_roughness(float roughness, float alpha_squared) {
    float alpha = GGX_alpha(roughness);
    return sqrt(min(sqrt(alpha * alpha + alpha_squared), 1.0));
}

// In lobes as wide as the directions are apart.
vec3 sent_by(Light light, Surface s, vec3 position, vec3 v) {
    vec3 l;
    vec3 irradiance = irradiance_from(light, position, l);
    float widening = patch_alpha_squared(patch_solid_angle(light, position, l));
    s.roughness = widened_roughness(s.roughness, widening);
    s.clearcoat_roughness = widened_roughness(s.clearcoat_roughness, widening);
    float weight = luminance(irradiance * evaluate_brdf(s, v, l, vec3(0.0, 1.0, 1.0)));
    return vec3(weight * vec2(visibility(light, position, triangle_of(s)), 1.0), 1.0);
}

// Heitz, Hill & McGuire 2018, "Combining Analytic Direct Illumination and Stochastic Shadows": the sky's image in a sharp
// lobe, which is known, is multiplied by the share of such light that is not in shadow. GGX falls off slowly: where no
// direction is near, the nearest decides. Where no surface is, the depth test fails.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Surface s = read_planes(pixel);
    if (sharpness(sharpest_roughness(s), view.sky_share) == 0.0) discard;
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(texelFetch(plane_depth, pixel, 0).x));
    vec3 v = direction_to_eye(position);
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < light_count; ++i) sum += sent_by(light_of(i), s, position, v);
    sent = vec4(sum, 0.0);
}
