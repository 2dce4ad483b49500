#!/bin/sh
# Runs a firmware in QEMU: qemu.sh MACHINE ELF [ARGUMENT...]. QEMU_OPTIONS adds options, for instance a serial line.
# One instruction takes 512 ns of the emulated time: the counters count instructions, the same in every run.
set -eu
machine=$1 elf=$2
shift 2
case $machine in
  m4f) qemu=qemu-system-arm board=mps2-an386 ;;
  m7) qemu=qemu-system-arm board=mps2-an500 ;;
  m55) qemu=qemu-system-arm board=mps3-an547 ;;
  riscv) qemu=qemu-system-riscv32 board="virt -bios none" ;;
  *) echo "qemu.sh: no machine $machine: use m4f, m7, m55 or riscv" >&2; exit 2 ;;
esac
command -v "$qemu" >/dev/null || PATH=$PATH:$HOME/.local/share/bare/bin
command -v "$qemu" >/dev/null || {
  echo "qemu.sh: $qemu is not there: install qemu-system-arm and qemu-system-misc" >&2
  exit 2
}
config=enable=on,target=native,arg=lacuna
for argument; do config=$config,arg=$argument; done
# shellcheck disable=SC2086
exec "$qemu" -M $board -nographic -monitor none -icount shift=9 -semihosting-config "$config" \
  ${QEMU_OPTIONS:--serial none} -kernel "$elf"
