#include "lib/view.glsl"
#include "lib/hash.glsl"
#include "lib/material.glsl"

// How much of what lies behind a surface it hides, along a direction NoV from its normal: docs/lighting.md.
float coverage_of(Material material, Surface s, float NoV) {
    if (material.opacity_threshold > 0.0) return material.opacity < material.opacity_threshold ? 0.0 : 1.0;
#ifdef TRANSPARENT
    if (material.is_transparent != 0u) return 1.0 - (1.0 - material.opacity) * left_by_lobes(s, NoV);
#endif
    return material.opacity;
}

// A coin a sample, so that the mean is sorted blending. Each triangle has its own: a closed mesh lies behind itself.
bool is_cut_out(float coverage, uint instance, uint material) {
    if (coverage <= 0.0 || coverage >= 1.0) return coverage <= 0.0;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    uvec4 seed = uvec4(pixel.x | pixel.y << 16u, instance, material, uint(gl_PrimitiveID));
    return coverage <= owen_van_der_corput(view.sample_index, seed);
}
