/// The console: a person or a script at a terminal, beside the flight software. docs/console.md.
#pragma once

#include "CommandLine.h"
#include "LogTransfer.h"
#include "MotorCommand.h"
#include "ParameterCommands.h"
#include "TextHistory.h"
#include "Version.h"

namespace strix {

/// One line in, lines out, the last of which is `ok` or `error: SENTENCE`. Runs in passes without a
/// control tick; a step takes a few characters and prints at most what one command prints; what
/// lasts goes on from step to step, and nothing waits.
///
/// @tparam Flight  status(), command(), parameters(), texts(), saveParameters(), store().state();
///                 const char* testMotor(int motor, float throttle, Micros duration): 0 for M1;
///                 nullptr or the refusal; ends by itself, and at once with a duration of 0
/// @tparam Port    read(), room(), write(): never wait
/// @tparam Bench   the card's logs: LogTransfer.h
template <class Flight, class Port, class Bench>
class Console {
 public:
  static constexpr int kCharactersAStep = 16;
  static constexpr std::size_t kWrittenAStep = 512;
  static constexpr Micros kArmCountdown = 5'000'000;

  Console(Flight& flight, Port& port, Bench& bench)
      : flight_(flight),
        port_(port),
        parameters_(flight, out_),
        motor_(flight, out_),
        logs_(bench, out_) {}

  void step(Micros now) {
    now_ = now;
    motor_.forget(now);
    // Characters wait in the port while parameters are set or saved: that ends soon, by itself.
    for (int i = 0; i < kCharactersAStep && !parameters_.active(); ++i) {
      std::uint8_t character = 0;
      if (port_.read(&character, 1) == 0) break;
      take(static_cast<char>(character));
    }
    if (running_) goOn();
    tell();
    std::size_t left = kWrittenAStep;
    out_.drain([this, &left](const char* text, std::size_t count) {
      std::size_t size = port_.room();
      size = size < count ? size : count;
      size = size < left ? size : left;
      if (size != 0) port_.write(reinterpret_cast<const std::uint8_t*>(text), size);
      left -= size;
      return size;
    });
  }

  /// `reboot` was typed with the motors off, and its answer is on its way: main.cpp restarts the
  /// processor.
  [[nodiscard]] bool rebootAsked() const { return rebootAsked_ && out_.empty(); }

 private:
  struct Command {
    const char* name;
    const char* arguments;
    const char* does;
    const char* example;
    const char* (Console::*run)(const Words&);  ///< nullptr, or why not
  };

  static constexpr Micros kOneEnter = 50'000;  // no hand presses two keys as fast
  static constexpr const char* kMotorsOn = "the motors are on: disarm first";

  /// Any character stops what runs; then it counts as typed. Only the line feed that a terminal
  /// sends with its return belongs to the command before it.
  void take(char c) {
    const bool sameEnter = c == '\n' && line_.returned() && elapsed(now_, returned_) < kOneEnter;
    if (c == '\r') returned_ = now_;
    if (!sameEnter && running_) stopByKey();
    switch (line_.take(c)) {
      case CommandLine::Event::Typed:
        typing_ = true;
        if (echo_) out_ << std::array<char, 2>{c, '\0'}.data();
        break;
      case CommandLine::Event::Erased:
        if (echo_) out_ << "\b \b";
        break;
      case CommandLine::Event::TooLong:
        endLine();
        finish("that line is longer than 40 characters");
        break;
      case CommandLine::Event::Line:
        endLine();
        obey(line_.text());
        break;
      case CommandLine::Event::Nothing:
        break;
    }
  }

  void endLine() {
    typing_ = false;
    if (echo_) out_ << "\n";
  }

  void obey(std::string_view line) {
    const Words words = mission_text::split(line, 0);
    if (words.word.empty()) return prompt();
    const Command* command = find(words.word);
    if (command == nullptr) return finish("there is no such command: type help");
    const char* const refusal = (this->*command->run)(words);
    running_ = arming_ || motor_.active() || logs_.active() || parameters_.active();
    if (!running_) finish(refusal);
  }

  void finish(const char* refusal) {
    running_ = false;
    if (refusal == nullptr) {
      out_ << "ok\n";
    } else {
      out_ << "error: " << refusal << "\n";
    }
    prompt();
  }

  void prompt() {
    if (echo_) out_ << "> ";
  }

  [[nodiscard]] static const Command* find(std::string_view name) {
    for (const Command& command : kCommands) {
      if (sameWord(name, command.name)) return &command;
    }
    return nullptr;
  }

  const char* help(const Words& words) {
    if (words.count == 0) {
      for (const Command& command : kCommands) {
        out_ << "  " << command.name << " " << command.arguments << Column{28} << command.does
             << "\n";
      }
      out_ << "Each ends with a line 'ok', or 'error: ' and why not.\n";
      return nullptr;
    }
    const Command* command = find(words.numbers[0]);
    if (command == nullptr) return "there is no such command: type help";
    out_ << command->name << " " << command->arguments << "\n  " << command->does
         << "\n  for example: " << command->example << "\n";
    return nullptr;
  }

  const char* status(const Words& /*words*/) {
    printStatus(out_, flight_.status());
    return nullptr;
  }
  const char* sensors(const Words& /*words*/) {
    printSensors(out_, flight_.status());
    return nullptr;
  }
  const char* checks(const Words& /*words*/) {
    printChecks(out_, flight_.status().preArm);
    return nullptr;
  }
  const char* version(const Words& /*words*/) {
    out_ << "Strix " << kVersion << (*kGitCommit == '\0' ? "" : " ") << kGitCommit << "\n";
    return nullptr;
  }

  const char* params(const Words& words) { return parameters_.list(words); }
  const char* param(const Words& words) { return parameters_.show(words); }
  const char* set(const Words& words) { return parameters_.set(words); }
  const char* save(const Words& /*words*/) { return parameters_.save(now_); }
  const char* defaults(const Words& /*words*/) { return parameters_.defaults(); }

  const char* send(CommandKind kind) {
    VehicleCommand command;
    command.kind = kind;
    command.source = CommandSource::Console;
    return flight_.command(command);
  }
  const char* disarm(const Words& /*words*/) { return send(CommandKind::Disarm); }
  const char* land(const Words& /*words*/) { return send(CommandKind::Land); }
  const char* calibrate(const Words& /*words*/) { return send(CommandKind::Calibrate); }
  const char* kill(const Words& words) {
    if (words.count == 0) return send(CommandKind::Kill);
    if (!sameWord(words.numbers[0], "off")) return "expected: kill, or kill off";
    return send(CommandKind::KillOff);
  }
  const char* arm(const Words& /*words*/) {
    const FlightStatus status = flight_.status();
    if (status.motorsOn) return "the motors are on already";
    if (*status.refusal != '\0') return status.refusal;
    arming_ = true;
    countdown_.start(now_, kArmCountdown);
    return nullptr;
  }

  const char* props(const Words& words) { return motor_.promise(now_, words); }
  const char* motor(const Words& words) { return motor_.start(now_, words); }

  const char* log(const Words& words) {
    std::uint32_t number = 0;
    const bool list = words.count == 1 && sameWord(words.numbers[0], "list");
    const bool get = words.count == 2 && sameWord(words.numbers[0], "get") &&
                     toWhole(words.numbers[1], 9'999'999, number);
    if (!list && !get) return "expected: log list, or log get NUMBER";
    if (flight_.status().motorsOn) return kMotorsOn;
    if (list) {
      logs_.startList();
    } else {
      logs_.startGet(now_, number);
    }
    return nullptr;
  }

  const char* texts(const Words& words) {
    return turn(texts_, words, "expected: texts on, or texts off");
  }
  const char* echo(const Words& words) {
    return turn(echo_, words, "expected: echo on, or echo off");
  }
  static const char* turn(bool& which, const Words& words, const char* expected) {
    const bool on = words.count == 1 && sameWord(words.numbers[0], "on");
    if (!on && !(words.count == 1 && sameWord(words.numbers[0], "off"))) return expected;
    which = on;
    return nullptr;
  }

  const char* reboot(const Words& /*words*/) {
    if (flight_.status().motorsOn) return kMotorsOn;
    rebootAsked_ = true;
    return nullptr;
  }
  const char* stop(const Words& /*words*/) { return nullptr; }  // its first letter has done it

  void stopByKey() {
    arming_ = false;
    motor_.stop();
    logs_.stop();
    finish("stopped by a key");
  }

  /// One of them runs: the next command begins when it has ended.
  void goOn() {
    const char* refusal = nullptr;
    if (arming_ && countdown_.over(now_, out_, "arming")) {
      arming_ = false;
      refusal = send(CommandKind::Arm);
    } else if (logs_.active()) {
      refusal = flight_.status().motorsOn ? kMotorsOn : logs_.step(now_);
      if (refusal != nullptr) logs_.stop();
    } else if (motor_.active()) {
      refusal = motor_.step(now_);
    } else if (parameters_.active()) {
      refusal = parameters_.step(now_);
    }
    if (!arming_ && !logs_.active() && !motor_.active() && !parameters_.active()) finish(refusal);
  }

  /// One text of the aircraft, "* battery low: flying home", between what is printed and before
  /// what is being typed. None while a log is on its way.
  void tell() {
    if (!texts_ || !out_.empty() || logs_.active()) return;
    const TextHistory::Text* text = flight_.texts().next(told_);
    if (text == nullptr) return;
    const bool prompted = echo_ && !running_;
    if (prompted) out_ << (typing_ ? "\n" : "\r");  // over a bare prompt
    out_ << "* "
         << (text->severity <= 3   ? "error: "
             : text->severity == 4 ? "warning: "
                                   : "")
         << text->text() << "\n";
    if (prompted) prompt();
    if (prompted && typing_) out_ << line_.text();
  }

  // Stands after what it names.
  // clang-format off
  static constexpr std::array<Command, 22> kCommands{{
      {"help", "[COMMAND]", "what there is to type", "help set", &Console::help},
      {"status", "", "state, position, battery, radio, log", "status", &Console::status},
      {"sensors", "", "what each sensor reads", "sensors", &Console::sensors},
      {"checks", "", "what arming asks for, and what is missing", "checks", &Console::checks},
      {"params", "[PATTERN]", "parameters with PATTERN in their name", "params rc_map", &Console::params},
      {"param", "NAME", "one of them, and what it is", "param FENCE_RADIUS", &Console::param},
      {"set", "NAME VALUE", "changes it, until the power goes", "set FENCE_RADIUS 25", &Console::set},
      {"save", "", "keeps what was set beyond that", "save", &Console::save},
      {"defaults", "", "sets all parameters to their defaults", "defaults", &Console::defaults},
      {"arm", "", "arms after 5 s; any key stops that", "arm", &Console::arm},
      {"disarm", "", "disarms, on the ground", "disarm", &Console::disarm},
      {"kill", "[off]", "motors off now, also in the air; off: back", "kill", &Console::kill},
      {"land", "", "lands here", "land", &Console::land},
      {"props", "off", "you have taken them off; counts for 60 s", "props off", &Console::props},
      {"motor", "N PERCENT SECONDS", "turns a motor after 3 s; any key stops it", "motor 1 10 2", &Console::motor},
      {"calibrate", "", "stand still and begin as after power-up", "calibrate", &Console::calibrate},
      {"log", "list | get NUMBER", "the card's logs; one of them as base64", "log get 12", &Console::log},
      {"texts", "on | off", "what the aircraft says, when it says it", "texts off", &Console::texts},
      {"echo", "on | off", "off, for scripts: no echo and no prompt", "echo off", &Console::echo},
      {"version", "", "of the flight software", "version", &Console::version},
      {"reboot", "", "starts again", "reboot", &Console::reboot},
      {"stop", "", "ends what runs, as any key does", "stop", &Console::stop},
  }};
  // clang-format on

  Flight& flight_;
  Port& port_;
  TextOut out_;
  CommandLine line_;
  ParameterCommands<Flight> parameters_;
  MotorCommand<Flight> motor_;
  LogTransfer<Bench> logs_;
  Countdown countdown_;
  Micros now_ = 0;
  Micros returned_ = 0;     ///< when a return came last
  std::uint32_t told_ = 0;  ///< place in the aircraft's texts
  bool running_ = false;    ///< a command that lasts has not ended
  bool arming_ = false;
  bool texts_ = true;
  bool echo_ = true;
  bool typing_ = false;  ///< something stands in the line
  bool rebootAsked_ = false;
};

}  // namespace strix
