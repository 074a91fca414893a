// A distant light: one triangle that covers the screen.
flat out uint light_index;

uniform uint first_light;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
    light_index = first_light + uint(gl_InstanceID);
    gl_Position = vec4(corner, 0.0, 1.0);
}
