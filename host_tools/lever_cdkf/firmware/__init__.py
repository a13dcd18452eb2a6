"""The firmware in this process: its library, configuration, instances and innovations, without CAN."""
