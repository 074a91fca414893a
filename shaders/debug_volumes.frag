#include "lib/view.glsl"

// A light's volume, each light in a colour of its own. A quad, which covers all of the image, is a frame along its edge.
out vec4 color;

uniform float opacity;
uniform int light_number;

const float FRAME_STEP = 8.0; // pixels between the frames of two lights
const float FRAME_WIDTH = 4.0;

// Hues a golden section of the circle apart: neighbours in number never look alike.
vec3 hue_of(int number) {
    float hue = fract(0.08 + 0.61803399 * float(number));
    return clamp(abs(fract(hue + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

void main() {
#ifdef VOLUME_QUAD
    vec2 aside = min(gl_FragCoord.xy, view.size - gl_FragCoord.xy);
    float into = min(aside.x, aside.y) - FRAME_STEP * float(light_number);
    if (into < 0.0 || into > FRAME_WIDTH) discard;
#endif
    color = vec4(hue_of(light_number) * opacity, opacity);
}
