// The error of a mean from the means of its batches: defshade_cli/passes/batch_means.py.
uniform sampler2D marks[BATCHES]; // luminance summed up to the end of each batch
uniform int batches;
uniform float batch_samples;
uniform float samples;
out vec2 result;                  // mean luminance, variance of the mean

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float means[BATCHES];
    float before = 0.0, mean = 0.0;
    for (int i = 0; i < batches; ++i) {
        float mark = texelFetch(marks[i], pixel, 0).x;
        means[i] = (mark - before) / batch_samples;
        mean += means[i] / float(batches);
        before = mark;
    }
    float squares = 0.0;
    for (int i = 0; i < batches; ++i) squares += (means[i] - mean) * (means[i] - mean);
    result = vec2(mean, squares / float(batches - 1) * batch_samples / samples);
}
