"""Calls for worker processes, which find them here whatever started the tests."""

import os
import signal
import sys

_greeting = ""


def greet(word):
    global _greeting
    _greeting = word


def greeting_and_pid():
    return _greeting, os.getpid()


def square(number):
    return number * number


def fail():
    raise ValueError("no")


def die(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def fail_to_start():
    sys.exit(3)
