#include "lib/view.glsl"
#include "lib/hash.glsl"

// opacityThreshold is an alpha test; other opacities are a coin a sample, so that the mean is sorted blending.
bool is_cut_out(Material material, float display_opacity, uint instance) {
    float opacity = material.uses_display_color != 0u ? display_opacity : material.opacity;
    if (material.opacity_threshold > 0.0) return opacity < material.opacity_threshold;
    if (opacity >= 1.0) return false;
    return opacity <= 0.0 || opacity < unit_hash(uvec4(gl_FragCoord.xy, view.sample_index, instance));
}
