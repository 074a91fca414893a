#include "lib/view.glsl"
#include "lib/light.glsl"

// A polyhedron that holds the unit sphere, scaled to the light's reach.
in vec3 corner;
flat out uint light_index;

uniform uint first_light;

void main() {
    light_index = first_light + uint(gl_InstanceID);
    Light light = lights[light_index];
    gl_Position = view.clip_from_relative * vec4(light.position + corner * light.reach, 1.0);
}
