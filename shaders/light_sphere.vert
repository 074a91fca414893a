#include "lib/view.glsl"
#include "lib/light.glsl"

// A polyhedron that holds the unit sphere, scaled to the light's reach.
in vec3 corner;
flat out Light light;

uniform uint first_light;

void main() {
    light = lights[first_light + uint(gl_InstanceID)];
    gl_Position = view.clip_from_relative * vec4(light.position + corner * light.reach, 1.0);
}
