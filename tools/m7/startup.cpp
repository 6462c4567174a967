/// Start of a program on the emulated Cortex-M7 (QEMU's mps2-an500) and its end: arguments come
/// from the host, standard output and exit status go to it, by semihosting (Arm, "Semihosting for
/// AArch32 and AArch64").
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>

extern "C" {
extern std::uint32_t stackTop;   // mps2-an500.ld; these are addresses, not variables
extern std::uint32_t dataImage;  // where .data lies in the loaded image
extern std::uint32_t dataStart;
extern std::uint32_t dataEnd;
extern std::uint32_t bssStart;
extern std::uint32_t bssEnd;
extern char heapStart;
extern char heapEnd;
void initialise_monitor_handles();  // newlib's librdimon: opens the host's standard streams
void __libc_init_array();
int programMain(int count, char** arguments) asm("main");  // no name for C++ to call
[[noreturn]] void resetHandler();
[[noreturn]] void faultHandler();
}

namespace {

/// Status of a program that the processor stopped: beyond what main returns.
constexpr int kFaultStatus = 99;

/// @return what the host answers
std::uint32_t semihost(std::uint32_t operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

[[noreturn]] void exitToHost(int status) {
  constexpr std::uint32_t kExitExtended = 0x20;
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t block[] = {kApplicationExit, static_cast<std::uint32_t>(status)};
  for (;;) semihost(kExitExtended, block);
}

/// The words that the host gives the program, the program's own name first.
class CommandLine {
 public:
  CommandLine() {
    constexpr std::uint32_t kGetCommandLine = 0x15;
    struct Block {
      char* text;
      std::size_t size;
    } const block{text_.data(), text_.size()};
    if (semihost(kGetCommandLine, &block) != 0) return;
    bool inWord = false;
    for (char* c = text_.data(); *c != '\0'; ++c) {
      const bool space = *c == ' ';
      if (space) *c = '\0';
      if (!space && !inWord && count_ + 1 < static_cast<int>(words_.size())) words_[count_++] = c;
      inWord = !space;
    }
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] char** words() { return words_.data(); }

 private:
  std::array<char, 1024> text_{};
  std::array<char*, 16> words_{};  ///< the last is null, as main expects
  int count_ = 0;
};

}  // namespace

[[gnu::section(".vectors"), gnu::used]] const void* const kVectors[] = {
    &stackTop,
    reinterpret_cast<const void*>(&resetHandler),
    reinterpret_cast<const void*>(&faultHandler),  // NMI
    reinterpret_cast<const void*>(&faultHandler),  // HardFault; the others escalate to it
};

void resetHandler() {
  // Coprocessors 10 and 11, the floating-point unit: full access (Armv7-M manual, CPACR).
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xFU << 20U;
  asm volatile("dsb\n isb" ::: "memory");

  const std::uint32_t* from = &dataImage;
  for (std::uint32_t* to = &dataStart; to < &dataEnd;) *to++ = *from++;
  for (std::uint32_t* to = &bssStart; to < &bssEnd;) *to++ = 0;

  initialise_monitor_handles();
  __libc_init_array();
  static CommandLine given;
  const int status = programMain(given.count(), given.words());
  std::fflush(nullptr);
  exitToHost(status);
}

void faultHandler() {
  constexpr std::uint32_t kWriteString = 0x04;
  semihost(kWriteString, "m7: the processor faulted\n");
  exitToHost(kFaultStatus);
}

/// The C library's heap: newlib's own would want it below the stack, in the same memory.
extern "C" void* _sbrk(std::ptrdiff_t increment) {
  static char* next = &heapStart;
  if (increment > &heapEnd - next) {
    errno = ENOMEM;
    return reinterpret_cast<void*>(-1);
  }
  char* const given = next;
  next += increment;
  return given;
}

// Asked for by __libc_init_array and empty here: crti.o is for -nostartfiles to leave out.
extern "C" void _init() {}

// Names the program itself to destructors that are registered at exit; crtbegin.o would define it.
extern "C" void* __dso_handle;
void* __dso_handle = nullptr;
