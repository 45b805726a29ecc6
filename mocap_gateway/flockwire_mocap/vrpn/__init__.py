"""VRPN over TCP: connection, client, and a server as its simulation twin.

Source: the Virtual-Reality Peripheral Network's published protocol (Russell M. Taylor II et al., "VRPN: a
device-independent, network-transparent VR peripheral system", VRST 2001, and vrpn_Connection, vrpn_Tracker of its
reference implementation, version 07.35, for the layout of messages).
"""
