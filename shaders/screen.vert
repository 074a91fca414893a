in vec4 region;                // left, top, right, bottom as shares of the image

uniform float screen_depth;

// A rectangle of the screen an instance.
void main() {
    vec2 corner = mix(region.xy, region.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    gl_Position = vec4(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, screen_depth, 1.0);
}
