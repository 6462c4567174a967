/// Counts the instructions of each call of the navigation filters, on the emulated Cortex-M7.
///
/// Prints one CSV line per function; bench.py sets them beside the budgets. The filters fly: every
/// call sees other numbers, P is full, and only calls whose scalars were all accepted are counted,
/// because a rejected one does less.
#include <ESKF.h>

#include <cstdint>

#include "Counts.h"
#include "Noise.h"

namespace {

using m7::Counts;
using strix::Micros;
using strix::Vector3f;

constexpr std::uint32_t kPasses = 8400;  ///< of a flight: 64 counted calls per function
constexpr std::uint32_t kWarmUp = 2000;  ///< passes before, ms: two seconds fill P and its biases
constexpr std::uint32_t kCountEvery = 100;  ///< passes, the period of the slowest sensor
constexpr Micros kPeriod = 1000;            ///< us, of the IMU
constexpr float kDt = 1e-3F;                ///< s, the same

/// An aircraft that turns about all axes while it moves gently, so that gravity is always usable.
struct Truth {
  float motion;  ///< 1 flies, 0 stands still
  float time = 0.0F;
  strix::VehicleState state;
  Vector3f forceBody = Vector3f::Zero();  ///< specific force, m/s^2

  void step() {
    time += kDt;
    const strix::SinCos slow = strix::sinCos(1.3F * time);
    const strix::SinCos fast = strix::sinCos(2.9F * time);
    state.rateBody = motion * Vector3f{0.8F * slow.sin, -0.6F * fast.cos, 0.5F * slow.cos};
    const Vector3f acceleration =
        motion * Vector3f{0.2F * slow.cos, -0.15F * fast.sin, 0.1F * fast.cos};
    state.attitude = strix::normalized(state.attitude * strix::quaternionExp(state.rateBody * kDt));
    state.positionNed += state.velocityNed * kDt;
    state.velocityNed += acceleration * kDt;
    forceBody =
        strix::rotateToBody(state.attitude, acceleration - Vector3f{0.0F, 0.0F, strix::kGravity});
  }
};

/// One filter with the aircraft it follows.
template <int States>
class Flight {
 public:
  Flight(float motion, strix::MagFusion fusion)
      : truth_{motion, 0.0F, {}, Vector3f::Zero()},
        filter_(configWith(fusion)),
        mag_(fusion == strix::MagFusion::ThreeAxis ? Counts("updateMagMeas", 3)
                                                   : Counts("updateMagMeas, heading only", 1)) {
    strix::Alignment alignment;
    alignment.attitude = truth_.state.attitude;
    alignment.magReference = kField;
    filter_.initialize(alignment, strix::kGravity);
  }

  /// One millisecond: predict and every update, the slower sensors at their own rates.
  void pass() {
    truth_.step();
    now_ += kPeriod;
    ++passes_;
    const Vector3f accel = truth_.forceBody + noise_.vector(0.05F);
    const Vector3f gyro = truth_.state.rateBody + noise_.vector(0.005F);
    const Vector3f mag = strix::rotateToBody(truth_.state.attitude, kField) + noise_.vector(0.3F);
    const float height = -truth_.state.positionNed.z() + 0.2F * noise_();
    const Vector3f position = truth_.state.positionNed + noise_.vector(1.0F);
    const Vector3f velocity = truth_.state.velocityNed + noise_.vector(0.1F);

    measure(predict_, nullptr, [&] { filter_.predict(accel, gyro, now_); });
    measure(tilt_, &filter_.tiltInnovation(), [&] { filter_.updateTiltMeas(accel); });
    if (passes_ % 10 == 0) {
      measure(mag_, &filter_.magInnovation(), [&] { filter_.updateMagMeas(mag, now_); });
    }
    if (passes_ % 20 == 0) {
      measure(alt_, &filter_.altInnovation(), [&] { filter_.updateAltMeas(height, now_); });
    }
    if (passes_ % 100 == 0) {
      measure(gps_, &filter_.gpsInnovation(), [&] { filter_.updateGPSMeas(position, velocity); });
    }
    if (truth_.motion == 0.0F) {
      measure(standstill_, nullptr, [&] { filter_.updateStandstill(); });
    }
    measure(inject_, nullptr, [&] { filter_.injectError(); });
  }

  void fly() {
    while (passes_ < kPasses) pass();
  }

  [[nodiscard]] bool printFlying() {
    bool complete = true;
    for (Counts* counts : {&predict_, &tilt_, &mag_, &alt_, &gps_, &inject_}) {
      complete = counts->print(States) && complete;
    }
    return complete;
  }
  [[nodiscard]] bool printStanding() {
    const bool complete = mag_.print(States);
    return standstill_.print(States) && complete;
  }

 private:
  /// Counts the call in those passes in which every sensor is due.
  /// @param innovation  what the call leaves there says whether its scalars were accepted
  template <class Call>
  void measure(Counts& counts, const strix::Innovation* innovation, Call call) {
    const m7::Counted count = m7::counter.count(call);
    const bool accepted = innovation == nullptr ||
                          (innovation->rejected == 0 && innovation->count == counts.scalars());
    if (accepted && passes_ > kWarmUp && passes_ % kCountEvery == 0) counts.add(count);
  }

  static strix::NavigationConfig configWith(strix::MagFusion fusion) {
    strix::NavigationConfig config;
    config.magFusion = fusion;
    return config;
  }

  inline static const Vector3f kField{18.0F, 1.5F, 45.0F};  ///< uT, NED, central Europe

  m7::Noise noise_;
  Truth truth_;
  strix::ESKF<States> filter_;
  Micros now_ = 0;
  std::uint32_t passes_ = 0;
  Counts predict_{"predict"};
  Counts tilt_{"updateTiltMeas", 3};
  Counts mag_;
  Counts alt_{"updateAltMeas", 1};
  Counts gps_{"updateGPSMeas", 4};
  Counts standstill_{"updateStandstill", 3};
  Counts inject_{"injectError"};
};

template <int States>
[[nodiscard]] bool bench() {
  static Flight<States> flying(1.0F, strix::MagFusion::ThreeAxis);
  flying.fly();
  static Flight<States> standing(0.0F, strix::MagFusion::HeadingOnly);
  standing.fly();
  const bool complete = flying.printFlying();
  return standing.printStanding() && complete;
}

}  // namespace

int main() {
  Counts::printHead();
  const bool complete = bench<9>();
  return bench<18>() && complete ? 0 : 1;
}
