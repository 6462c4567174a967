/// `params`, `param`, `set`, `save` and `defaults`.
#pragma once

#include "ConsoleTables.h"
#include "ParameterStore.h"
#include "Time.h"
#include "VehicleCommand.h"

namespace strix {

template <class Flight>
class ParameterCommands {
 public:
  static constexpr Micros kSaveTime = 10'000'000;

  ParameterCommands(Flight& flight, TextOut& out) : flight_(flight), out_(out) {}

  const char* list(const Words& words) {
    const std::string_view pattern = words.count == 0 ? std::string_view{} : words.numbers[0];
    if (printParameters(out_, flight_.parameters(), pattern) != 0) return nullptr;
    return "no parameter has that in its name: type params";
  }

  const char* show(const Words& words) {
    if (words.count != 1) return "expected: param NAME";
    const std::size_t place = named(words.numbers[0]);
    if (place == kParameterCount) return kNone;
    printParameter(out_, flight_.parameters(), kParameterTable[place]);
    return nullptr;
  }

  const char* set(const Words& words) {
    float value = 0.0F;
    if (words.count != 2) return "expected: set NAME VALUE";
    const std::size_t place = named(words.numbers[0]);
    if (place == kParameterCount) return kNone;
    if (!toNumber(words.numbers[1], value)) {
      return "VALUE is a number of at most 7 digits, such as 12.5";
    }
    if (const char* refusal = send(place, value)) return refusal;
    const ParameterInfo& info = kParameterTable[place];
    out_ << info.name << " = " << Plain{value};
    printUnit(out_, info) << (info.lock == ParameterLock::Start ? "; save it: acts after a reboot\n"
                                                                : "; save keeps it\n");
    return nullptr;
  }

  /// Done when it is written and read back.
  const char* save(Micros now) {
    if (const char* refusal = flight_.saveParameters()) return refusal;
    task_ = Task::Save;
    since_ = now;
    return nullptr;
  }

  const char* defaults() {
    if (flight_.status().motorsOn) return "the motors are on: disarm first";
    task_ = Task::Defaults;
    place_ = changed_ = 0;
    return nullptr;
  }

  [[nodiscard]] bool active() const { return task_ != Task::None; }

  /// @return nullptr, or why it has ended
  const char* step(Micros now) {
    if (task_ == Task::None) return nullptr;
    const char* const refusal = task_ == Task::Save ? waitForSave(now) : nextDefault();
    if (refusal != nullptr) task_ = Task::None;
    return refusal;
  }

 private:
  enum class Task { None, Save, Defaults };

  static constexpr const char* kNone = "there is no such parameter: type params";

  /// @return its place in the table, kParameterCount without one
  [[nodiscard]] static std::size_t named(std::string_view name) {
    std::size_t i = 0;
    while (i < kParameterCount && !sameWord(kParameterTable[i].name, name)) ++i;
    return i;
  }

  CommandRefusal send(std::size_t place, float value) {
    VehicleCommand command;
    command.kind = CommandKind::SetParameter;
    command.source = CommandSource::Console;
    command.index = static_cast<std::uint16_t>(place);
    command.values[0] = value;
    return flight_.command(command);
  }

  const char* waitForSave(Micros now) {
    const SaveState state = flight_.store().state();
    if (state == SaveState::Failed) {
      return "the memory does not keep it; what was saved before is still there";
    }
    if (state == SaveState::Done) task_ = Task::None;
    return elapsed(now, since_) < kSaveTime ? nullptr : "not saved: it waits for motors off";
  }

  /// One parameter a step: each is a command of its own, with its record in the log.
  const char* nextDefault() {
    if (place_ == kParameterCount) {
      out_ << std::uint32_t(changed_) << " changed; save keeps it\n";
      task_ = Task::None;
      return nullptr;
    }
    const std::size_t place = place_++;
    const float standard = kParameterTable[place].standard;
    if (getParameter(flight_.parameters(), place) == standard) return nullptr;
    ++changed_;
    return send(place, standard);
  }

  Flight& flight_;
  TextOut& out_;
  Task task_ = Task::None;
  Micros since_ = 0;       ///< when saving began
  std::size_t place_ = 0;  ///< of the parameter that gets its default next
  std::size_t changed_ = 0;
};

}  // namespace strix
