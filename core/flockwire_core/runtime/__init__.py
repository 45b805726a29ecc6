"""The shell around every core: the only package that uses Zenoh and asyncio."""
