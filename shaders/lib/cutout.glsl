#include "lib/view.glsl"
#include "lib/hash.glsl"

// opacityThreshold is an alpha test; other opacities are a coin a sample, so that the mean is sorted blending.
bool is_cut_out(Material material, uint instance) {
    if (material.opacity_threshold > 0.0) return material.opacity < material.opacity_threshold;
    if (material.opacity >= 1.0) return false;
    return material.opacity <= 0.0 || material.opacity < unit_hash(uvec4(gl_FragCoord.xy, view.sample_index, instance));
}
