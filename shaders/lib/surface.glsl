#include "lib/brdf.glsl"

#ifdef PATCHES
// The normals of a sample's share of its pixel: `side`² of them in rows, what is added to the middle one for the first and from
// one to the next.
struct Footprint {
    int side;
    vec3 first;
    vec3 across;
    vec3 along;
};
const vec3 STILL = vec3(0.0);
const Footprint POINT = Footprint(1, STILL, STILL, STILL);
#endif

// What the GBuffer says of one pixel.
struct Surface {
    vec3 normal;               // unit, facing the camera
    vec3 base;
    float metallic;
    float roughness;
    vec3 emission;
    vec3 f0;
    vec3 f90;
    float clearcoat;
    float clearcoat_roughness;
    float blur;                // of lobes, in slopes squared: the disc that one of the normals below stands for
#ifdef PATCHES
    Footprint footprint;
#endif
#ifdef PLANE_LINKS
    uint link_set;
#endif
#ifdef PLANE_WEIGHTS
    vec2 weights;              // of the diffuse, and of lobes and emission: what a sample that was kept stands for
    float turn;                // of the normal over a pixel, squared
#endif
#ifdef PLANE_TRIANGLE
    vec3 triangle;             // unit normal of what is drawn, facing the camera
#endif
};

// For the look-ups of shadows that need it.
vec3 triangle_of(Surface s) {
#ifdef PLANE_TRIANGLE
    return s.triangle;
#else
    return vec3(0.0);
#endif
}

// Reflectance at normal incidence of a dielectric in air.
float F0_from_ior(float ior) {
    float r = (1.0 - ior) / (1.0 + ior);
    return r * r;
}

const float DEFAULT_F0 = 0.04; // ior 1.5, UsdPreviewSurface's default

// UsdPreviewSurface, metallic workflow: F0 and F90 go from the dielectric's to the base colour's.
void set_metallic_fresnel(inout Surface s, float dielectric_f0) {
    s.f90 = mix(vec3(1.0), s.base, s.metallic);
    s.f0 = mix(dielectric_f0 * s.f90, s.f90, s.metallic);
}

// 1 for lobes too narrow for the directions of a sky, four a sample, to find; 0 for wide ones. A lobe's solid angle goes
// by the fourth power of its roughness, so that any of them is found by enough samples.
float sharpness(float roughness, float sky_share) {
    float narrowest = sqrt(sqrt(16.0 * sky_share));
    return 1.0 - smoothstep(0.25 * narrowest, 0.45 * narrowest, roughness);
}

float sharpest_roughness(Surface s) {
#ifdef PLANE_CLEARCOAT
    if (s.clearcoat > 0.0) return min(s.roughness, s.clearcoat_roughness);
#endif
    return s.roughness;
}

// The part of the light along a direction that the lobes leave to what lies below them, at most.
float left_by_lobes(Surface s, float NoV) {
    vec3 E = E_bound(s.f0, s.f90, NoV, GGX_alpha(s.roughness), SMITH_GGX);
    float coat = E_bound(vec3(DEFAULT_F0), vec3(1.0), NoV, GGX_alpha(s.clearcoat_roughness), SMITH_GGX).x;
    return clamp(1.0 - max(E.r, max(E.g, E.b)), 0.0, 1.0) * (1.0 - s.clearcoat * coat);
}

// Of a normal over a pixel, squared, by its change to the right and to the top.
float turn_of(vec3 across, vec3 along) {
    return dot(across, across) + dot(along, along);
}

struct Angles {
    float NoV, NoL, NoH, VoH;
};

Angles angles_between(vec3 n, vec3 v, vec3 l, vec3 h) {
    return Angles(max(dot(n, v), MIN_NOV), dot(n, l), dot(n, h), dot(v, h));
}

// D of the lobe and of the coat's, at one normal.
vec2 D_at(Surface s, vec3 n, vec3 h) {
#ifdef PLANE_CLEARCOAT
    float coat = D_blurred(GGX_alpha(s.clearcoat_roughness), s.blur, n, h);
#else
    float coat = 0.0;
#endif
    return vec2(D_blurred(GGX_alpha(s.roughness), s.blur, n, h), coat);
}

// The same of what a sample stands for. One loop for both: compilers take long for many.
vec2 D_of(Surface s, vec3 h) {
#ifdef PATCHES
    vec3 first = s.normal + s.footprint.first;
    vec2 sum = D_at(s, first, h);
#ifdef CELL_PARTS
    int side = s.footprint.side;
    for (int i = 1; i < side * side; ++i) {
        vec3 n = first + float(i % side) * s.footprint.across + float(i / side) * s.footprint.along;
        sum += D_at(s, n, h);
    }
    sum /= float(side * side);
#endif
    return sum;
#else
    return D_at(s, s.normal, h);
#endif
}

// G2 / (4 NoL NoV), in the sample's blur.
float V_of(float alpha, Surface s, Angles a) {
    return V_SmithGGXCorrelated(a.NoV, a.NoL, blurred_alpha_squared(alpha, s.blur));
}

// UsdPreviewSurface as its schema describes it, but that no lobe leaves more light below it than it has not taken:
// docs/lighting.md. `response` scales the diffuse, the specular and the coat's lobe.
vec3 brdf_preview_surface(Surface s, Angles a, vec3 h, vec3 response) {
    float alpha = GGX_alpha(s.roughness);
    vec3 F = F_Schlick(s.f0, s.f90, a.VoH);
    float mu = min(a.NoV, a.NoL);
    vec3 taken = max(F, E_bound(s.f0, s.f90, mu, alpha, SMITH_GGX));
    vec3 diffuse = s.base * ((1.0 - s.metallic) / PI) * (1.0 - taken);
    vec2 D = D_of(s, h);
    vec3 specular = D.x * V_of(alpha, s, a) * F;
    vec3 result = diffuse * response.x + specular * response.y;
#ifdef PLANE_CLEARCOAT
    float coat_alpha = GGX_alpha(s.clearcoat_roughness);
    float coat_F = F_Schlick(vec3(DEFAULT_F0), vec3(1.0), a.VoH).x;
    float coat_taken = max(coat_F, E_bound(vec3(DEFAULT_F0), vec3(1.0), mu, coat_alpha, SMITH_GGX).x);
    float coat = D.y * V_of(coat_alpha, s, a) * coat_F;
    result = result * (1.0 - s.clearcoat * coat_taken) + s.clearcoat * coat * response.z;
#endif
    return result;
}

// The seed's lighting equation with its defects mended: docs/lighting.md.
vec3 brdf_classic(Surface s, Angles a, vec3 h, vec3 response) {
    float alpha = GGX_alpha(s.roughness);
    vec3 real_albedo = s.base - s.base * s.metallic;
    vec3 real_specular = mix(vec3(0.03), s.base, s.metallic);
    vec3 F = F_Schlick(real_specular, vec3(1.0), a.VoH);
    vec3 specular = D_of(s, h).x * V_SmithSchlick(a.NoV, a.NoL, sqrt(blurred_alpha_squared(alpha, s.blur))) * F;
    vec3 taken = max(specular, E_bound(real_specular, vec3(1.0), min(a.NoV, a.NoL), alpha, SMITH_SCHLICK));
    return real_albedo / PI * max(1.0 - taken, 0.0) * response.x + specular * response.y;
}

// The BRDF times NoL, for unit vectors towards the eye and the light.
vec3 evaluate_brdf(Surface s, vec3 v, vec3 l, vec3 response) {
    vec3 h = normalize(v + l);
    Angles a = angles_between(s.normal, v, l, h);
    if (a.NoL <= 0.0) return vec3(0.0);
#ifdef CLASSIC
    return brdf_classic(s, a, h, response) * a.NoL;
#else
    return brdf_preview_surface(s, a, h, response) * a.NoL;
#endif
}
