"""Contacts: the laws, a file each in the folder of their slot, and the model that joins them."""
