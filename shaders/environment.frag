#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/environment.glsl"
#include "generated/planes.glsl"

uniform vec2 response;             // of the diffuse and of the specular lobe
out vec4 radiance;

// One sample without noise: irradiance by spherical harmonics, the specular lobe by a blurred sky. No shadows.
vec3 analytic_reflection(Surface s, vec3 v) {
    float NoV = max(dot(s.normal, v), MIN_NOV);
    float alpha = GGX_alpha(s.roughness);
    vec3 specular = lobe_albedo(s.f0, s.f90, s.roughness, NoV);
    vec3 diffuse = s.base * ((1.0 - s.metallic) / PI) * (1.0 - specular) * sky_irradiance(s.normal);
    vec3 mirrored = reflect(-v, s.normal);
    vec3 result = diffuse * response.x + specular * response.y * sky_radiance(mirrored, lobe_lod(alpha));
#ifdef PLANE_CLEARCOAT
    float coat = s.clearcoat * lobe_albedo(vec3(DEFAULT_F0), vec3(1.0), s.clearcoat_roughness, NoV).x;
    float lod = lobe_lod(GGX_alpha(s.clearcoat_roughness));
    result = result * (1.0 - coat) + coat * response.y * sky_radiance(mirrored, lod);
#endif
    return result;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    bool covered = stored != BACKGROUND_DEPTH;
    vec3 position = position_at(gl_FragCoord.xy, covered ? camera_depth(stored) : 1.0);
    vec3 v = direction_to_eye(position);
    radiance = vec4(0.0);
#ifdef BACKGROUND
    if (!covered) radiance = vec4(view.exposure * sky_radiance(-v, 0.0), 1.0);
#endif
#ifdef ANALYTIC
    if (covered) radiance.rgb = view.exposure * analytic_reflection(read_planes(pixel), v);
#endif
}
