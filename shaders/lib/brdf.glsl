#include "lib/constants.glsl"

float GGX_alpha(float roughness) {
    return clamp(roughness * roughness, MIN_ALPHA, 1.0);
}

// Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces".
// 1 - NoH^2 = |n x h|^2 (Lagrange's identity) keeps narrow lobes exact in float32.
float D_GGX(float alpha, float NoH, vec3 n, vec3 h) {
    vec3 nxh = cross(n, h);
    float a = NoH * alpha;
    float k = alpha / (dot(nxh, nxh) + a * a);
    return k * k * (1.0 / PI);
}

#ifdef PATCHES
float blurred_alpha_squared(float alpha, float blur) {
    return min(alpha * alpha + blur, 1.0);
}

// GGX as a disc of slopes sees it, whose radius squared is `blur`. Over slopes GGX is the form factor between a patch and a plane
// parallel to it at a distance of alpha, and this its mean over a disc there (Howell, "A Catalog of Radiation Heat Transfer
// Configuration Factors", B-13): without its cancellations, and times cos² of the half vector in each length. n of any length.
float D_blurred(float alpha, float blur, vec3 n, vec3 h) {
    vec3 nxh = cross(n, h);
    float NoH = dot(n, h), cos2 = NoH * NoH, sin2 = dot(nxh, nxh), a2 = alpha * alpha * cos2;
    float inward = sin2 - blur * cos2, outside = inward + a2;
    float across = sqrt(inward * inward + a2 * (2.0 * (sin2 + blur * cos2) + a2));
    float farther = across + abs(outside), squared = sin2 + cos2;
    vec2 share = outside > 0.0 ? vec2(2.0 * alpha * alpha, farther) : vec2(farther, 2.0 * blur * cos2 * cos2);
    return squared * squared * share.x / (PI * across * share.y);
}
#else
float blurred_alpha_squared(float alpha, float blur) {
    return alpha * alpha;
}

float D_blurred(float alpha, float blur, vec3 n, vec3 h) {
    return D_GGX(alpha, dot(n, h), n, h);
}
#endif

// Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", G2 / (4 NoL NoV).
float V_SmithGGXCorrelated(float NoV, float NoL, float a2) {
    float lambda_v = NoL * sqrt(NoV * NoV * (1.0 - a2) + a2);
    float lambda_l = NoV * sqrt(NoL * NoL * (1.0 - a2) + a2);
    return 0.5 / (lambda_v + lambda_l);
}

// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering": G1 with k = alpha / 2
// on both sides, divided by 4 NoL NoV.
float V_SmithSchlick(float NoV, float NoL, float alpha) {
    float k = 0.5 * alpha;
    return 0.25 / ((NoV * (1.0 - k) + k) * (NoL * (1.0 - k) + k));
}

// Schlick 1994.
vec3 F_Schlick(vec3 f0, vec3 f90, float VoH) {
    float x = clamp(1.0 - VoH, 0.0, 1.0);
    float x2 = x * x;
    return f0 + (f90 - f0) * (x2 * x2 * x);
}

// At least the directional albedo of a lobe with F_Schlick: F0 W + (F90 - F0) B, W of a white lobe and B of its edge
// weight (1 - VoH)^5. W <= 1 - ln 2 alpha^2 mu; B's constants come from defshade_cli/measure/albedo.py.
vec3 E_bound(vec3 f0, vec3 f90, float mu, float alpha, vec4 fit) {
    float y = 1.0 - mu;
    float y2 = y * y;
    float n = alpha + mu * (fit.x + fit.y * mu);
    float a2 = alpha * alpha;
    float edge = y * (y2 * y2 * n + fit.w * alpha * mu) / (n + fit.z * a2);
    return f0 * (1.0 - 0.6931 * a2 * mu) + (f90 - f0) * edge;
}

const vec4 SMITH_GGX = vec4(0.157, 3.167, 14.64, 0.2199);
const vec4 SMITH_SCHLICK = vec4(0.0, 3.108, 22.64, 0.2103);
