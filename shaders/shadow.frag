#ifdef CUTOUT
#include "lib/view.glsl"
#include "lib/cutout.glsl"

layout(std430, binding = 2) readonly buffer MaterialBlock { Material materials[]; };

in float display_opacity;
flat in uint material_index;
flat in uint instance_index;

void main() {
    if (is_cut_out(materials[material_index], display_opacity, instance_index)) discard;
}
#else
void main() {}
#endif
