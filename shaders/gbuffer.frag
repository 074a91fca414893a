#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/cutout.glsl"
#include "lib/material.glsl"
#ifdef TEXTURES
#include "lib/texture.glsl"
#endif
#include "generated/planes.glsl"

in vec3 normal_relative;
in vec4 display_color;
flat in uint material_index;
flat in uint instance_index;
flat in float handedness;
#ifdef TEXTURES
in vec3 position_relative;
in vec4 uv;
#endif

Surface surface_of(Material material, vec3 normal) {
    Surface s;
    s.normal = normal;
    s.base = material.diffuse_color;
    s.metallic = material.metallic;
    s.roughness = material.roughness;
    s.emission = material.emissive_color;
    s.clearcoat = material.clearcoat;
    s.clearcoat_roughness = material.clearcoat_roughness;
    set_metallic_fresnel(s, F0_from_ior(material.ior));
    if (material.use_specular_workflow != 0u) {
        s.metallic = 0.0;
        s.f0 = material.specular_color;
        s.f90 = vec3(1.0);
    }
    return s;
}

void main() {
    Material material = material_at(material_index, display_color);
    float side = gl_FrontFacing ? handedness : -handedness;
    vec3 normal = normalize(normal_relative);
#ifdef TEXTURES
    apply_textures(material, normal, position_relative, uv);
#endif
#ifdef CUTOUT
    if (is_cut_out(material, instance_index) || (material.one_sided != 0u && side < 0.0)) discard;
#endif
    write_planes(surface_of(material, side * normal));
}
