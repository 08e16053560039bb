"""`python -m rhythmid` is the command `rhythmid`."""

from rhythmid.cli import main

main()
