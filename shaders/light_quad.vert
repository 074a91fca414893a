#include "lib/light.glsl"

// A distant light: every region of the screen, as shaders/screen.vert draws them.
in vec4 region;
flat out Light light;

uniform uint first_light;

void main() {
    vec2 corner = mix(region.xy, region.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    light = lights[first_light];
    gl_Position = vec4(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.0, 1.0);
}
