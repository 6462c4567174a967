/// Second-order filters of vectors: low-pass and notch.
///
/// Coefficients by the bilinear transform, prewarped at the named frequency, so that the response
/// there is exact at any sample rate; R. Bristow-Johnson, "Audio EQ cookbook", low-pass and notch.
/// The same numbers as scipy.signal.butter and iirnotch (test_biquad.py).
#pragma once

#include "Deterministic.h"
#include "Vector3f.h"

namespace strix {

/// y = b0 x + b1 x' + b2 x'' - a1 y' - a2 y'' (a0 = 1). By default y = x.
struct BiquadCoefficients {
  float b0 = 1.0F;
  float b1 = 0.0F;
  float b2 = 0.0F;
  float a1 = 0.0F;
  float a2 = 0.0F;
};

/// What the coefficients below are good for: between 1/200 of the sample rate, where rounding moves
/// the cut-off by 1e-4 of it, and 9/10 of Nyquist.
[[nodiscard]] constexpr bool isFilterFrequency(float hz, float sampleHz) {
  return hz >= sampleHz / 200.0F && hz <= 0.45F * sampleHz;
}

/// Butterworth: -3 dB at the cut-off, gain 1 at 0 Hz, 0 at Nyquist.
/// @param cutoff, sampleHz  Hz; isFilterFrequency holds
[[nodiscard]] inline BiquadCoefficients lowPass(float cutoff, float sampleHz) {
  const SinCos turn = sinCos(2.0F * kPi * cutoff / sampleHz);
  const float alpha = 0.70710678F * turn.sin;  // sin / (2 Q), Q = 1 / sqrt(2)
  const float a1 = -2.0F * turn.cos / (1.0F + alpha);
  const float a2 = (1.0F - alpha) / (1.0F + alpha);
  // From the rounded a1 and a2, and in this order, which rounds nothing at low cut-offs: 0 Hz
  // passes with gain 1 whatever rounding did to the cut-off.
  const float b0 = 0.25F * ((1.0F + a1) + a2);
  return {b0, 2.0F * b0, b0, a1, a2};
}

/// Nothing at the centre, -3 dB at the edges of a band centre / q wide, gain 1 at 0 Hz and Nyquist.
/// The cookbook's sin(w) / (2 q) lets the band shrink towards Nyquist; tan(w / (2 q)) does not.
/// @param centre, sampleHz  Hz; isFilterFrequency holds    @param q  at least 1
[[nodiscard]] inline BiquadCoefficients notch(float centre, float q, float sampleHz) {
  const float w = 2.0F * kPi * centre / sampleHz;
  const SinCos halfBand = sinCos(w / (2.0F * q));
  const float b0 = halfBand.cos / (halfBand.cos + halfBand.sin);  // 1 / (1 + tan)
  const float b1 = -2.0F * cosine(w) * b0;
  return {b0, b1, b0, b1, 2.0F * b0 - 1.0F};
}

/// One such filter.
///
/// Direct form I: what it remembers is its last inputs and outputs, which mean the same under any
/// coefficients. A notch that jumps from 80 to 320 Hz in a steady turn changes nothing at all; the
/// transposed form II, whose state is made of coefficients, puts 17 % of the rate onto its output.
/// In float32 it is also the more exact of the two (25 Hz of 1125 Hz at 35 rad/s: 9e-5 against
/// 1.3e-4 rad/s).
///
/// A sample with NaN or infinity is left out: the output stays what it was, and nothing of it is
/// remembered.
class Biquad {
 public:
  /// Takes effect with the next sample. The memory is kept.
  void setCoefficients(const BiquadCoefficients& coefficients) { c_ = coefficients; }

  /// The first sample counts as having been there for ever: no start from zero.
  [[nodiscard]] Vector3f update(const Vector3f& input) {
    if (!isFinite(input)) return output1_;
    if (!started_) settle(input);
    Vector3f output =
        c_.b0 * input + c_.b1 * input1_ + c_.b2 * input2_ - c_.a1 * output1_ - c_.a2 * output2_;
    if (!isFinite(output)) {  // overflow, by numbers that no sensor gives
      settle(input);
      return output1_;
    }
    input2_ = input1_;
    input1_ = input;
    output2_ = output1_;
    output1_ = output;
    return output;
  }

 private:
  void settle(const Vector3f& value) {
    input1_ = input2_ = output1_ = output2_ = value;
    started_ = true;
  }

  BiquadCoefficients c_;
  Vector3f input1_ = Vector3f::Zero();
  Vector3f input2_ = Vector3f::Zero();
  Vector3f output1_ = Vector3f::Zero();
  Vector3f output2_ = Vector3f::Zero();
  bool started_ = false;
};

}  // namespace strix
