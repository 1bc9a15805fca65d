"""Function blocks beside the excitation: sliding DFT, ring buffer and program, also as files of TwinCAT 3."""
