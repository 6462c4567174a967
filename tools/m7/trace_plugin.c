/* A plugin of QEMU's that writes which instructions some of a program's counted calls executed.

   InstructionCounter.h makes every counted call with one instruction, `blx r2`, and comes back to
   the next. The calls are numbered from 1 as the program makes them.

     -plugin file=trace_plugin.so,call=ADDRESS,back=ADDRESS,numbers=3+17+29,out=FILE

   ADDRESS of that instruction and of the next; numbers in rising order. FILE gets a line "call 3"
   and then one hexadecimal address per instruction.

   The declarations are QEMU's plugin interface, version 1 (qemu.org, "TCG Plugins"): Debian ships
   the interface without its header. */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_insn;
struct qemu_plugin_tb;
enum { QEMU_PLUGIN_CB_NO_REGS };
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                           void (*translated)(qemu_plugin_id_t id,
                                                              struct qemu_plugin_tb* block));
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn* instruction,
                                            void (*executed)(unsigned int processor, void* data),
                                            int registers, void* data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb* block, size_t index);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn* instruction);

/* What QEMU looks up. */
extern int qemu_plugin_version;
int qemu_plugin_version = 1;
int qemu_plugin_install(qemu_plugin_id_t id, const void* info, int count, char** arguments);

static uintptr_t call_address;
static uintptr_t back_address;
static const char* numbers; /* from the next one wanted on */
static unsigned long calls; /* made so far */
static FILE* out;
static int writing;

/* Before every instruction. */
static void executed(unsigned int processor, void* data) {
  const uintptr_t address = (uintptr_t)data;
  (void)processor;
  if (address == back_address) writing = 0;
  if (writing) fprintf(out, "%lx\n", (unsigned long)address);
  if (address != call_address || *numbers == '\0') return;
  ++calls;
  if (calls != strtoul(numbers, NULL, 10)) return;
  numbers += strcspn(numbers, "+");
  numbers += *numbers == '+';
  fprintf(out, "call %lu\n", calls);
  writing = 1;
}

/* Once for each block of instructions, when QEMU first meets it. */
static void translated(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  for (size_t i = 0; i < qemu_plugin_tb_n_insns(block); ++i) {
    struct qemu_plugin_insn* instruction = qemu_plugin_tb_get_insn(block, i);
    const uintptr_t address = (uintptr_t)qemu_plugin_insn_vaddr(instruction);
    qemu_plugin_register_vcpu_insn_exec_cb(instruction, executed, QEMU_PLUGIN_CB_NO_REGS,
                                           (void*)address);
  }
}

/* The value of "name=value", or null. */
static const char* value_of(const char* name, int count, char** arguments) {
  const size_t length = strlen(name);
  for (int i = 0; i < count; ++i) {
    if (strncmp(arguments[i], name, length) == 0 && arguments[i][length] == '=') {
      return arguments[i] + length + 1;
    }
  }
  return NULL;
}

int qemu_plugin_install(qemu_plugin_id_t id, const void* info, int count, char** arguments) {
  const char* call = value_of("call", count, arguments);
  const char* back = value_of("back", count, arguments);
  const char* path = value_of("out", count, arguments);
  (void)info;
  numbers = value_of("numbers", count, arguments);
  if (call == NULL || back == NULL || path == NULL || numbers == NULL) return 1;
  call_address = strtoul(call, NULL, 0);
  back_address = strtoul(back, NULL, 0);
  out = fopen(path, "w");
  if (out == NULL) return 1;
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  return 0;
}
