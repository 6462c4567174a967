/// Start of a program on the emulated Cortex-M7 (QEMU's mps2-an500) and its end: standard output
/// and the exit status go to the host by semihosting (Arm, "Semihosting for AArch32 and AArch64").
#include <cstdint>
#include <cstdio>

extern "C" {
extern std::uint32_t stackTop;   // mps2-an500.ld; these are addresses, not variables
extern std::uint32_t dataImage;  // where .data lies in the loaded image
extern std::uint32_t dataStart;
extern std::uint32_t dataEnd;
extern std::uint32_t bssStart;
extern std::uint32_t bssEnd;
void initialise_monitor_handles();  // newlib's librdimon: opens the host's standard streams
void __libc_init_array();
int main();
[[noreturn]] void resetHandler();
[[noreturn]] void faultHandler();
}

namespace {

/// Status of a program that the processor stopped: beyond what main returns.
constexpr int kFaultStatus = 99;

void semihost(std::uint32_t operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

[[noreturn]] void exitToHost(int status) {
  constexpr std::uint32_t kExitExtended = 0x20;
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t block[] = {kApplicationExit, static_cast<std::uint32_t>(status)};
  for (;;) semihost(kExitExtended, block);
}

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
  const int status = main();
  std::fflush(nullptr);
  exitToHost(status);
}

void faultHandler() {
  constexpr std::uint32_t kWriteString = 0x04;
  semihost(kWriteString, "m7: the processor faulted\n");
  exitToHost(kFaultStatus);
}

// Asked for by __libc_init_array and empty here: crti.o is for -nostartfiles to leave out.
extern "C" void _init() {}

// Names the program itself to destructors that are registered at exit; crtbegin.o would define it.
extern "C" void* __dso_handle;
void* __dso_handle = nullptr;
