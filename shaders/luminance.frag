#include "lib/luminance.glsl"

uniform sampler2D radiance;
out float result;

void main() {
    result = luminance(texelFetch(radiance, ivec2(gl_FragCoord.xy), 0).rgb);
}
