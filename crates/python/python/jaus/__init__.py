"""SAE JAUS nodes, components and clients for asyncio."""
