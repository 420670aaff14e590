// This target exists for its precompiled header alone.
