#!/usr/bin/python3
"""Stands in for an interpreter that has PyTorch loaded already: warm_python.py SCRIPT ARGUMENTS...

The first call of a process starts a server in the environment of the call. The server loads PyTorch once, forks for each
script that the process runs in this environment, and ends with the process. A script has the standard streams of its
call, and the working folder of the first.
"""
import hashlib
import os
import runpy
import select
import signal
import socket
import sys
import traceback


def serve(listener, caller):
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the scripts
    caller_ends = os.pidfd_open(caller)
    import numpy  # noqa: F401
    import torch  # noqa: F401
    while caller_ends not in select.select([listener, caller_ends], [], [])[0]:
        call, _ = listener.accept()
        words, streams, _, _ = socket.recv_fds(call, 1 << 16, 3)
        if os.fork() == 0:
            run(words.decode().split("\0"), streams, call)
        for descriptor in (*streams, call.detach()):
            os.close(descriptor)


def run(words, streams, call):
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    for own, stream in enumerate(streams):
        os.dup2(stream, own)
        os.close(stream)
    sys.argv, sys.path[0] = words, os.path.dirname(words[0])
    code = 1
    try:
        runpy.run_path(words[0], run_name="__main__")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    call.send(bytes([code]))
    os._exit(0)


def main():
    caller = os.getppid()
    environment = hashlib.sha256(repr(sorted(os.environ.items())).encode()).hexdigest()
    address = "\0warm_python %d %s" % (caller, environment[:32])
    call = socket.socket(socket.AF_UNIX)
    if call.connect_ex(address) != 0:
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(address)
        listener.listen()
        if os.fork() == 0:
            try:
                call.close()
                serve(listener, caller)
            finally:
                os._exit(0)
        listener.close()
        call.connect(address)
    socket.send_fds(call, ["\0".join(sys.argv[1:]).encode()], [0, 1, 2])
    code = call.recv(1)  # nothing where PyTorch could not be loaded or the script was killed
    sys.exit(code[0] if code else 1)


if __name__ == "__main__":
    main()
