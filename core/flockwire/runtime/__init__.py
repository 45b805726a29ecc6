"""The shell round every core: the only room that knows Zenoh and asyncio."""
