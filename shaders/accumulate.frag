uniform sampler2D sample_radiance;
out vec4 radiance_sum;

void main() {
    radiance_sum = texelFetch(sample_radiance, ivec2(gl_FragCoord.xy), 0);
}
