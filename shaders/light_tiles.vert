// A tile of the image an instance, and the run of the lists that names its lights.
in vec4 region;                // left, top, right, bottom as shares of the image
in uvec2 run;                  // first entry, and how many
flat out uvec2 tile_run;

void main() {
    vec2 corner = mix(region.xy, region.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    tile_run = run;
    gl_Position = vec4(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.0, 1.0);
}
