#include "lib/shading.glsl"
#include "lib/environment.glsl"
#include "lib/hash.glsl"
#ifdef HIDDEN_SKY
#include "lib/rays.glsl"
#endif
#include "generated/outputs.glsl"

uniform sampler2D sky_density;     // of all directions that stand for the sky in all samples, by solid angle
uniform vec2 response;             // of the diffuse and of the specular lobe
uniform float cell_lod;            // of the sky, whose texels are as large as the cells that directions are drawn from
uniform float tree_rounding;       // of where its triangles are
uniform uint rays;                 // of a pixel in this sample
#ifdef PLANE_LINKS
uniform uint first_link;
#endif

const float RAY_OFFSET = 2e-5;     // of the distance, along the normal: clears a depth's rounding

// Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
vec3 visible_normal(vec3 v, vec3 n, float alpha, vec2 u) {
    vec3 aside = v - n * dot(n, v);
    vec3 x = dot(aside, aside) > 1e-8 ? normalize(aside) : normalize(cross(view.relative_from_camera[1].xyz, n));
    vec3 y = cross(n, x);
    vec3 stretched = normalize(vec3(alpha * dot(v, x), alpha * dot(v, y), dot(v, n)));
    float turn = 2.0 * PI * u.x, z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    float across = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 cap = vec3(across * cos(turn), across * sin(turn), z) + stretched;
    return normalize(alpha * (cap.x * x + cap.y * y) + max(cap.z, 0.0) * n);
}

vec3 ray_direction(Surface s, vec3 v, vec2 u) {
    float roughness = s.roughness;
#ifdef PLANE_CLEARCOAT
    float coat = coat_rays(s, dot(s.normal, v));
    bool on_coat = u.y < coat;
    roughness = on_coat ? s.clearcoat_roughness : s.roughness;
    u.y = on_coat ? u.y / coat : (u.y - coat) / max(1.0 - coat, 1e-6);
#endif
    return reflect(-v, visible_normal(v, s.normal, GGX_alpha(roughness), u));
}

// The sky along `l`, as blurred as the part of it that one of `density` directions stands for, but within the cells in which
// shared directions are drawn evenly: a sun must not leak to where few of them are.
vec3 sky_around(vec3 l, float density) {
    vec2 size = vec2(textureSize(sky, 0));
    return sky_radiance(l, clamp(0.5 * log2(size.x * size.y / (2.0 * PI * PI * density)), 0.0, cell_lod));
}

// The sky in a surface's lobes by this pixel's own rays, as far as they do better than the directions that all pixels share.
vec3 sky_by_rays(Surface s, vec3 position, vec3 v, uvec2 pixel) {
    float share = ray_share(s, v);
    vec3 total = vec3(0.0);
    if (share == 0.0) return total;
    vec3 above = position + s.normal * (RAY_OFFSET * length(position) + tree_rounding);
    for (uint i = 0u; i < rays; ++i) {
        vec3 l = ray_direction(s, v, owen_sobol(view.sample_index * rays + i, uvec4(pixel, 0x5eu, 0u)));
        if (dot(s.normal, l) <= 0.0) continue;
        float drawn = view.sky_rays * share;
        float density = drawn * ray_density(s, v, l) + textureLod(sky_density, latlong(sky_from_relative * l), 0.0).r;
#ifdef HIDDEN_SKY
        if (meets_anything(above, l)) continue;
#endif
        total += drawn / density * sky_around(l, density) * evaluate_brdf(s, v, l, vec3(0.0, response.yy));
    }
    return total / float(rays);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    if (stored == BACKGROUND_DEPTH) discard;
    Surface s = read_planes(pixel);
#ifdef PLANE_LINKS
    if (!is_linked(first_link, s.link_set)) discard;
#endif
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored));
    vec3 light = sky_by_rays(s, position, direction_to_eye(position), uvec2(pixel) + uvec2(view.origin));
    write_light(exposed(Lit(light, vec3(0.0), 0.0, 0.0, 0.0)));
}
