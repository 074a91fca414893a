#ifdef CUTOUT
#include "lib/view.glsl"
#include "lib/cutout.glsl"
#include "lib/material.glsl"
#ifdef TEXTURES
#include "lib/texture.glsl"

in UvSets uv;
#endif
#ifdef TRANSPARENT
in vec3 position_relative;
in vec3 normal_relative;

uniform vec4 towards_light;    // its position, or with w = 0 its direction
#endif
in vec4 display_color;
flat in uint material_index;
flat in uint instance_index;

#ifdef TRANSPARENT
// As the light sees it, whichever side is turned to it.
float cast_coverage(Material material) {
    vec3 normal = normalize(normal_relative);
#ifdef TEXTURES
    apply_textures(material, normal, position_relative, uv);
#endif
    vec3 l = normalize(towards_light.xyz - towards_light.w * position_relative);
    return coverage_of(material, surface_of(material, normal), max(abs(dot(normal, l)), MIN_NOV));
}
#else
float cast_coverage(Material material) {
#ifdef TEXTURES
    apply_opacity_texture(material, uv);
#endif
    return coverage_of(material, surface_of(material, vec3(0.0)), 1.0);
}
#endif

void main() {
    Material material = with_display(materials[material_index], display_color);
    if (is_cut_out(cast_coverage(material), instance_index, material_index)) discard;
}
#else
void main() {}
#endif
