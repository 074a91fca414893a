#include "lib/view.glsl"
#include "lib/hash.glsl"

// opacityThreshold is an alpha test; other opacities are a coin a sample, so that the mean is sorted blending.
bool is_cut_out(Material material, uint instance) {
    if (material.opacity_threshold > 0.0) return material.opacity < material.opacity_threshold;
    if (material.opacity >= 1.0) return false;
    uvec2 pixel = uvec2(ivec2(gl_FragCoord.xy) + ivec2(view.origin)); // parts of an image fall as the whole does
    return material.opacity <= 0.0 || material.opacity < unit_hash(uvec4(pixel, view.sample_index, instance));
}
