#include "generated/display.glsl"

uniform sampler2D image;           // scene-linear, premultiplied
uniform bool straight;             // undo that, and leave it undone: the transform is not linear
uniform float brightest;           // what is beyond is clamped; NaN is 0
out vec4 shown;

void main() {
    vec4 texel = texelFetch(image, ivec2(gl_FragCoord.xy), 0);
    texel = clamp(mix(texel, vec4(0.0), isnan(texel)), -brightest, brightest);
    if (straight && texel.a > 0.0) texel.rgb /= texel.a;
    shown = vec4(clamp(display(vec4(texel.rgb, 1.0)).rgb, 0.0, 1.0), texel.a);
}
