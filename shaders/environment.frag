#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/environment.glsl"
#include "generated/planes.glsl"
#include "generated/outputs.glsl"
#ifdef PLANE_LINKS
#include "lib/linking.glsl"

uniform uint first_link;
#endif

uniform vec2 response;             // of the diffuse and of the specular lobe
#ifdef OCCLUSION
uniform sampler2D sky_visibility;  // what reached sharp lobes so far, what was sent, and the number of directions
uniform sampler2D sky_visibility_before; // the same without this sample
#endif

// The part of a lobe that this pass shows: all of it in a single sample, else what sampled directions would miss.
float share(float roughness) {
#ifdef ANALYTIC
    return 1.0;
#else
    return sharpness(roughness, view.sky_share);
#endif
}

#ifdef OCCLUSION
// How much of a sharp lobe the geometry leaves open as far as is known, times the directions that know it.
float known_openness(vec3 known) {
    return known.y > 0.0 ? known.z * known.x / known.y : known.z;
}
#endif

// The same of one sample, with what it teaches of those before: the mean over samples is what all directions know.
float openness() {
#ifdef OCCLUSION
    vec3 known = texelFetch(sky_visibility, ivec2(gl_FragCoord.xy), 0).xyz;
    vec3 before = texelFetch(sky_visibility_before, ivec2(gl_FragCoord.xy), 0).xyz;
    if (known.z == before.z) return 1.0;
    return (known_openness(known) - known_openness(before)) / (known.z - before.z);
#else
    return 1.0;
#endif
}

// A lobe's mirror image of the sky, as blurred as the lobe is wide.
vec3 mirrored_sky(vec3 n, vec3 v, float roughness) {
    return share(roughness) * response.y * sky_radiance(reflect(-v, n), lobe_lod(GGX_alpha(roughness)));
}

// The sky's light on a surface: all of it, and the diffuse lobe's part.
vec3 reflected_sky(Surface s, vec3 v, out vec3 diffuse) {
    diffuse = vec3(0.0);
#ifdef PLANE_LINKS
    if (!is_linked(first_link, s.link_set)) return vec3(0.0);
#endif
    float NoV = max(dot(s.normal, v), MIN_NOV);
    vec3 albedo = E_bound(s.f0, s.f90, NoV, GGX_alpha(s.roughness), SMITH_GGX);
    vec3 specular = albedo * mirrored_sky(s.normal, v, s.roughness);
#ifdef ANALYTIC
    diffuse = s.base * ((1.0 - s.metallic) / PI) * (1.0 - albedo) * response.x * sky_irradiance(s.normal);
#endif
#ifdef PLANE_CLEARCOAT
    float coat_alpha = GGX_alpha(s.clearcoat_roughness);
    float coat = s.clearcoat * E_bound(vec3(DEFAULT_F0), vec3(1.0), NoV, coat_alpha, SMITH_GGX).x;
    diffuse *= 1.0 - coat;
    specular = specular * (1.0 - coat) + coat * mirrored_sky(s.normal, v, s.clearcoat_roughness);
#endif
#ifdef PLANE_WEIGHTS
    diffuse *= s.weights.x;
    specular *= s.weights.y;
#endif
    return diffuse + openness() * specular;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    bool covered = stored != BACKGROUND_DEPTH;
    vec3 position = position_at(gl_FragCoord.xy, covered ? camera_depth(stored) : 1.0);
    vec3 v = direction_to_eye(position);
    float alpha = 0.0;
    Lit lit = Lit(vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0);
#ifdef BACKGROUND
    if (!covered) {
        lit.radiance = view.exposure * sky_radiance(-v, 0.0);
        alpha = 1.0;
    }
#endif
#ifndef LOBE_RAYS
    if (covered) lit.radiance = view.exposure * reflected_sky(read_planes(pixel), v, lit.diffuse);
#endif
#ifdef SPLIT
    lit.diffuse *= view.exposure;
#endif
    write_light(lit);
    radiance.a = alpha;
}
