#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "lib/cutout.glsl"
#include "generated/planes.glsl"

layout(std430, binding = 2) readonly buffer MaterialBlock { Material materials[]; };

in vec3 normal_relative;
in vec4 display_color;
flat in uint material_index;
flat in uint instance_index;
flat in float handedness;

vec3 facing_normal() {
    float side = gl_FrontFacing ? handedness : -handedness;
    return normalize(normal_relative) * side;
}

Surface surface_of(Material material) {
    Surface s;
    s.normal = facing_normal();
    s.base = material.uses_display_color != 0u ? display_color.rgb : material.diffuse_color;
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
    Material material = materials[material_index];
#ifdef CUTOUT
    if (is_cut_out(material, display_color.a, instance_index)) discard;
#endif
    write_planes(surface_of(material));
}
