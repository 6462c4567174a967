#include "ImuIcm20649.h"

namespace strix {

namespace {

void wait(Micros us) { delayMicroseconds(us); }

template <class Device>
Device deviceOn([[maybe_unused]] I2cBus& bus) {
  if constexpr (std::is_same_v<Device, SpiDevice>) {
    return Device();
  } else {
    return Device(bus, ImuIcm20649::kAddress);
  }
}

template <class Device>
void start([[maybe_unused]] Device& device) {
  if constexpr (std::is_same_v<Device, SpiDevice>) device.begin();  // TeensyBoard begins I2C
}

}  // namespace

ImuIcm20649::ImuIcm20649(I2cBus& bus) : device_(deviceOn<Device>(bus)), driver_(device_, kConfig) {}

void ImuIcm20649::dataReady() {
  edgeTime = ::micros();
  edges = edges + 1;
}

icm20649::DataReady ImuIcm20649::newestEdge() {
  // An interrupt between the two reads would pair a count with the next sample's time.
  icm20649::DataReady newest;
  do {
    newest.count = edges;
    newest.time = edgeTime;
  } while (newest.count != edges);
  return newest;
}

bool ImuIcm20649::begin() {
  start(device_);
  pinMode(pins::kImuDataReady, INPUT_PULLDOWN);
  setup_ = driver_.begin(wait);
  if (setup_ != icm20649::Setup::Ready) return false;
  seenEdges_ = edges;
  lastEdge_ = ::micros();
  attachInterrupt(pins::kImuDataReady, dataReady, RISING);
  return true;
}

icm20649::SelfTest ImuIcm20649::selfTest() { return driver_.selfTest(wait); }

bool ImuIcm20649::read(ImuRaw& out) {
  if (taken_ < filled_) {
    out = batch_[taken_++];
    return true;
  }
  const icm20649::DataReady newest = newestEdge();
  const Micros now = ::micros();
  const bool edge = newest.count != seenEdges_;
  if (edge) {
    seenEdges_ = newest.count;
    lastEdge_ = now;
  } else if (elapsed(now, lastEdge_) >= kSilence && elapsed(now, lastPoll_) >= kPollPeriod) {
    lastPoll_ = now;
  } else {
    return false;
  }
  bool found = false;
  if constexpr (kFifo) {
    found = refill(edge);
    if (found) out = batch_[taken_++];
  } else {
    found = readOne(edge, edge ? newest.time : now, out);
  }
  if (found && !edge) ++polled_;
  return found;
}

/// @param isNew  the sensor said so: the same bytes again are another sample, for a while
bool ImuIcm20649::readOne(bool isNew, Micros sampled, ImuRaw& out) {
  const icm20649::Reading reading = driver_.read(out);
  out.sampled = sampled;
  return reading == icm20649::Reading::New || (reading == icm20649::Reading::Repeated && isNew);
}

bool ImuIcm20649::refill(bool edge) {
  taken_ = 0;
  filled_ = driver_.readFifo(
      [edge] {
        icm20649::DataReady newest = newestEdge();
        if (!edge) newest.time = ::micros();
        return newest;
      },
      batch_.data(), batch_.size());
  return filled_ != 0;
}

}  // namespace strix
