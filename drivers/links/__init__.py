"""Where bytes come from: serial ports and, for simulated instruments, memory."""
