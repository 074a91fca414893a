#include "generated/display.glsl"

layout(binding = 0, rgba32f) readonly restrict uniform image2D image; // scene-linear, premultiplied
uniform bool straight;             // undo that, and leave it undone: the transform is not linear
uniform float brightest;           // what is beyond is clamped; NaN is 0
out vec4 shown;

void main() {
    vec4 texel = imageLoad(image, ivec2(gl_FragCoord.xy));
    texel = clamp(mix(texel, vec4(0.0), isnan(texel)), -brightest, brightest);
    if (straight && texel.a > 0.0) texel.rgb /= texel.a;
    shown = vec4(clamp(display(vec4(texel.rgb, 1.0)).rgb, 0.0, 1.0), texel.a);
}
