// SPDX-License-Identifier: BSD-3-Clause
#include "tests/recon/nerf/kernels/tile_trap.hpp"

#include <signal.h>
#include <ucontext.h>

#include <cstdint>
#include <cstring>

#include "tests/recon/nerf/kernels/tile_machine.hpp"

namespace orbitfuse::nerf::test {
namespace {

TileMachine machine;
int count = 0;
struct sigaction before;

std::int64_t value_of(const ucontext_t& context, int encoded) {
  constexpr int place[16] = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP,
                             REG_RSI, REG_RDI, REG_R8,  REG_R9,  REG_R10, REG_R11,
                             REG_R12, REG_R13, REG_R14, REG_R15};
  return context.uc_mcontext.gregs[place[encoded]];
}

/// An instruction with a three-byte VEX prefix (Intel SDM volume 2, 2.3).
struct Instruction {
  int map, prefix, opcode, mod, reg, rm, second;  ///< `second`: vvvv
  std::uint8_t* address = nullptr;                ///< of the memory operand
  std::int64_t stride = 0;                        ///< its index register
  int length = 0;
};

Instruction decode(const std::uint8_t* code, const ucontext_t& context) {
  Instruction i{};
  if (code[0] != 0xc4) return i;
  const int index_high = code[1] & 0x40 ? 0 : 8, base_high = code[1] & 0x20 ? 0 : 8;
  i.map = code[1] & 0x1f;
  i.second = ~code[2] >> 3 & 15;
  i.prefix = code[2] & 3;
  i.opcode = code[3];
  i.mod = code[4] >> 6;
  i.reg = code[4] >> 3 & 7;
  i.rm = code[4] & 7;
  i.length = 5;
  if (i.mod == 3) return i;
  std::int64_t address = 0;
  int base = i.rm;
  if (i.rm == 4) {
    const int sib = code[i.length++], index = (sib >> 3 & 7) + index_high;
    if (index != 4) i.stride = value_of(context, index) << (sib >> 6);
    base = sib & 7;
  }
  const bool no_base = i.mod == 0 && base == 5;
  const bool relative = no_base && i.rm == 5;
  if (!no_base) address = value_of(context, base + base_high);
  if (i.mod == 1) address += static_cast<std::int8_t>(code[i.length++]);
  if (i.mod == 2 || no_base) {
    std::int32_t offset;
    std::memcpy(&offset, code + i.length, 4);
    address += offset;
    i.length += 4;
  }
  if (relative) address += reinterpret_cast<std::int64_t>(code) + i.length;
  i.address = reinterpret_cast<std::uint8_t*>(address);
  return i;
}

/// False if it is none of the tiles' instructions.
bool execute(const Instruction& i) {
  constexpr int none = 0, f3 = 2, f2 = 3;
  if (i.length == 0 || i.map != 2) return false;
  const bool memory = i.mod != 3;
  if (i.opcode == 0x49 && i.prefix == none && memory && i.reg == 0)
    machine.configure(i.address);
  else if (i.opcode == 0x49 && i.prefix == none && !memory && i.reg == 0 && i.rm == 0)
    machine.release();
  else if (i.opcode == 0x49 && i.prefix == f2 && !memory && i.rm == 0)
    machine.zero(i.reg);
  else if (i.opcode == 0x4b && i.prefix == f2 && memory && i.rm == 4)
    machine.load(i.reg, i.address, i.stride);
  else if (i.opcode == 0x4b && i.prefix == f3 && memory && i.rm == 4)
    machine.store(i.reg, i.address, i.stride);
  else if (i.opcode == 0x5c && i.prefix == f3 && !memory)
    machine.multiply_add(i.reg, i.rm, i.second);
  else
    return false;
  ++count;
  return true;
}

void on_unknown_instruction(int, siginfo_t*, void* raw) {
  auto& context = *static_cast<ucontext_t*>(raw);
  auto& next = context.uc_mcontext.gregs[REG_RIP];
  const Instruction i = decode(reinterpret_cast<const std::uint8_t*>(next), context);
  if (execute(i))
    next += i.length;
  else
    sigaction(SIGILL, &before, nullptr);  // and fail there again
}

}  // namespace

TileTrap::TileTrap() {
  machine.release();
  count = 0;
  struct sigaction action = {};
  action.sa_sigaction = on_unknown_instruction;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  sigaction(SIGILL, &action, &before);
}

TileTrap::~TileTrap() { sigaction(SIGILL, &before, nullptr); }

int TileTrap::executed() const { return count; }
bool TileTrap::configured() const { return machine.configured(); }

}  // namespace orbitfuse::nerf::test
