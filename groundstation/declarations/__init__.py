"""What a part, topic, node, port, action, view row, table, vehicle and vehicle type *are*.

Below bus and parts, so that neither needs the rig: a part declares itself in these words, the rig puts
parts together, runners execute what is declared.
"""
