#ifdef CUTOUT
#include "lib/view.glsl"
#include "lib/cutout.glsl"
#include "lib/material.glsl"
#ifdef TEXTURES
#include "lib/texture.glsl"

in vec4 uv;
#endif
in float display_opacity;
flat in uint material_index;
flat in uint instance_index;

void main() {
    Material material = material_at(material_index, vec4(vec3(0.0), display_opacity));
#ifdef TEXTURES
    apply_opacity_texture(material, uv);
#endif
    if (is_cut_out(material, instance_index)) discard;
}
#else
void main() {}
#endif
