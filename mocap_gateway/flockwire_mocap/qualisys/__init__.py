"""Qualisys QTM's real-time protocol: a client on the package `qtm-rt`, and a server as its simulation twin.

Source of the layout: the vendor's documentation of the QTM real-time server protocol.
"""
