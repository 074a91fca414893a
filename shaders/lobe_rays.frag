#include "lib/shading.glsl"
#include "lib/hash.glsl"
#ifdef HIDDEN
#include "lib/rays.glsl"
#endif
#ifdef LAMPS
#include "lib/lamps.glsl"
#else
#include "lib/environment.glsl"
#endif
#include "generated/outputs.glsl"

uniform float tree_rounding;       // of where its triangles are
uniform uint rays;                 // of a pixel in this sample

const float RAY_OFFSET = 2e-5;     // of the distance, along the normal: clears a depth's rounding

// One of a pixel's rays, what lights it up, and what hides that.
struct Ray {
    vec3 from;                 // on the surface
    vec3 above;                // clear of it
    vec3 along;
    float drawn;               // of all rays of the pixel that count, by solid angle
};

bool is_hidden(Ray ray, float reach) {
#ifdef HIDDEN
    return meets_anything(ray.above, ray.along, reach);
#else
    return false;
#endif
}

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

#ifdef LAMPS
uniform uvec2 lamp_run;            // the first of some lamps, and how many

// The rays' share of what lamps send along one.
vec3 light_along(Ray ray, Surface s) {
    vec3 total = vec3(0.0);
    for (uint i = lamp_run.x; i < lamp_run.x + lamp_run.y; ++i) {
        LampHit hit = meets_lamp(lamps[i], lights[i], ray.from, ray.along);
        if (hit.solid_angle == 0.0 || !is_lit_by(lights[i], s)) continue;
        if (lamps[i].casts_shadow != 0u && is_hidden(ray, hit.distance * (1.0 - RAY_OFFSET) - tree_rounding)) continue;
        vec3 emitted = lights[i].response.y * lamps[i].radiance * hit.tint * shaped(lights[i], ray.along);
        total += emitted * share_of_rays(ray.drawn * hit.solid_angle);
    }
    return render_from_rec709(total);
}
#else
uniform sampler2D sky_density;     // of all directions that stand for the sky in all samples, by solid angle
uniform vec2 response;             // of the diffuse and of the specular lobe
uniform float cell_lod;            // of the sky, whose texels are as large as the cells that directions are drawn from
#ifdef PLANE_LINKS
uniform uint first_link;
#endif

// The sky along `l`, as blurred as the part of it that one of `density` directions stands for, but within the cells in which
// shared directions are drawn evenly: a sun must not leak to where few of them are.
vec3 sky_around(vec3 l, float density) {
    vec2 size = vec2(textureSize(sky, 0));
    return sky_radiance(l, clamp(0.5 * log2(size.x * size.y / (2.0 * PI * PI * density)), 0.0, cell_lod));
}

vec3 light_along(Ray ray, Surface s) {
#ifdef PLANE_LINKS
    if (!is_linked(first_link, s.link_set)) return vec3(0.0);
#endif
    if (is_hidden(ray, 3.0e38)) return vec3(0.0);
    float density = textureLod(sky_density, latlong(sky_from_relative * ray.along), 0.0).r;
    return response.y * sky_around(ray.along, ray.drawn + density) * share_of_rays(ray.drawn / density);
}
#endif

// What a surface's lobes show of lights by this pixel's own rays, as far as they do better than what all pixels share.
vec3 light_by_rays(Surface s, vec3 position, vec3 v, uvec2 pixel) {
    float share = ray_share(s, v);
    vec3 total = vec3(0.0);
    if (share == 0.0) return total;
    vec3 above = position + s.normal * (RAY_OFFSET * length(position) + tree_rounding);
    for (uint i = 0u; i < rays; ++i) {
        vec3 l = ray_direction(s, v, owen_sobol(view.sample_index * rays + i, uvec4(pixel, 0x5eu, 0u)));
        if (dot(s.normal, l) <= 0.0) continue;
        float density = ray_density(s, v, l);
        Ray ray = Ray(position, above, l, view.lobe_rays * share * density);
        vec3 light = light_along(ray, s);
        if (light != vec3(0.0)) total += light / density * evaluate_brdf(s, v, l, vec3(0.0, 1.0, 1.0));
    }
    return total / float(rays);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    if (stored == BACKGROUND_DEPTH) discard;
    Surface s = read_planes(pixel);
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored));
    vec3 light = light_by_rays(s, position, direction_to_eye(position), uvec2(pixel) + uvec2(view.origin));
    write_light(exposed(Lit(light, vec3(0.0), 0.0, 0.0, 0.0)));
}
